// Moves a camera through the map: W A S D, Q E, arrows; drag to look around.
import * as THREE from 'three';

const kWays = { w: [0, 1, 0], s: [0, -1, 0], a: [-1, 0, 0], d: [1, 0, 0], e: [0, 0, 1], q: [0, 0, -1] };
const kArrows = { ArrowUp: 'w', ArrowDown: 's', ArrowLeft: 'a', ArrowRight: 'd' };

export function flyControls(camera, canvas, render) {
  let on = false, speed = 1, fast = false, before = 0, heading = 0, tilt = 0, drag = null;
  const held = new Set();

  const aim = () => {
    camera.up.set(0, 0, 1);
    camera.lookAt(camera.position.clone().add(new THREE.Vector3(
      Math.cos(tilt) * Math.cos(heading), Math.cos(tilt) * Math.sin(heading), Math.sin(tilt))));
    render();
  };
  function step(now) {
    if (!on || !held.size) { before = 0; return; }
    const seconds = before ? Math.min(0.1, (now - before) / 1000) : 0.016;
    before = now;
    const ahead = camera.getWorldDirection(new THREE.Vector3());
    const right = ahead.clone().cross(new THREE.Vector3(0, 0, 1)).normalize();
    for (const key of held) {
      const [x, y, z] = kWays[key];
      camera.position.addScaledVector(right, x * speed * seconds * (fast ? 4 : 1));
      camera.position.addScaledVector(ahead, y * speed * seconds * (fast ? 4 : 1));
      camera.position.z += z * speed * seconds * (fast ? 4 : 1);
    }
    aim();
    requestAnimationFrame(step);
  }
  const hold = (key, down) => {
    if (!on || !kWays[key]) return;
    const first = down && !held.size;
    if (down) held.add(key); else held.delete(key);
    if (first) requestAnimationFrame(step);
  };
  const keyOf = (e) => kArrows[e.key] || e.key.toLowerCase();
  canvas.addEventListener('keydown', (e) => {
    fast = e.shiftKey;
    if (!on || !kWays[keyOf(e)] || e.ctrlKey || e.metaKey) return;
    hold(keyOf(e), true);
    e.preventDefault();
  });
  canvas.addEventListener('keyup', (e) => { fast = e.shiftKey; hold(keyOf(e), false); });
  canvas.addEventListener('blur', () => held.clear());
  canvas.addEventListener('pointerdown', (e) => { drag = on ? [e.clientX, e.clientY] : null; });
  canvas.addEventListener('pointermove', (e) => {
    if (!on || !drag || !e.buttons) return;
    heading += 0.004 * (e.clientX - drag[0]);
    tilt = Math.min(1.5, Math.max(-1.5, tilt + 0.004 * (e.clientY - drag[1])));
    drag = [e.clientX, e.clientY];
    aim();
  });
  return {
    hold,
    setSpeed: (metresPerSecond) => { speed = metresPerSecond; },
    start: () => {
      const ahead = camera.getWorldDirection(new THREE.Vector3());
      heading = Math.atan2(ahead.y, ahead.x);
      tilt = Math.asin(Math.min(1, Math.max(-1, ahead.z)));
      on = true;
      canvas.focus();
    },
    stop: () => { on = false; held.clear(); },
  };
}
