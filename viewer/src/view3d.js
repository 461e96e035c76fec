// The 3D view with three.js: orbit, fly, from above; click to choose a plane.
import * as THREE from 'three';
import { OrbitControls } from 'three/addons/controls/OrbitControls.js';
import { flyControls } from './fly.js';
import { linesOf, planesOf, pointsOf, surfelsOf, surfelValues, keyframesOf } from './shapes.js';

const kColoursOfNothing = [138, 143, 148];

// Everything the view holds of one state of the map.
function contents(L) {
  const box = new THREE.Box3();
  L.planes.forEach((p) => p.outlines.forEach((o) => o.forEach((q) => box.expandByPoint(new THREE.Vector3(...q)))));
  const t = L.trajectory;
  for (let i = 0; t && i < t.count; ++i) box.expandByPoint(new THREE.Vector3().fromArray(t.positions, 3 * i));
  if (box.isEmpty()) box.set(new THREE.Vector3(-1, -1, 0), new THREE.Vector3(1, 1, 1));
  const origin = box.getCenter(new THREE.Vector3());
  const reach = Math.max(1, 0.5 * box.getSize(new THREE.Vector3()).length());
  const extent = L.planes.flatMap((plane) => plane.outlines.flatMap((o) => o.map((q) => new THREE.Vector3(...q).sub(origin))));
  for (let i = 0; t && i < t.count; ++i) extent.push(new THREE.Vector3().fromArray(t.positions, 3 * i).sub(origin));
  return { origin, reach, extent };
}

window.laminaView3d = (host, L) => {
  const renderer = new THREE.WebGLRenderer({ antialias: true, preserveDrawingBuffer: true });
  const canvas = renderer.domElement;
  canvas.tabIndex = 0;
  canvas.setAttribute('role', 'img');
  canvas.setAttribute('aria-label', '3D view of the map; arrow keys move it');
  host.append(canvas);
  const scene = new THREE.Scene();
  const dark = window.matchMedia('(prefers-color-scheme: dark)');
  const camera = new THREE.PerspectiveCamera(50, 1, 0.1, 100);
  camera.up.set(0, 0, 1);
  const controls = new OrbitControls(camera, canvas);
  controls.listenToKeyEvents(canvas);
  const render = () => renderer.render(scene, camera);
  const fly = flyControls(camera, canvas, render);
  controls.addEventListener('change', render);

  let origin = null, reach = 1, extent = [], groups = {}, meshes = [], surfels = null, colourKind = 'height', moved = false;
  const group = (key) => { if (!groups[key]) scene.add(groups[key] = new THREE.Group()); return groups[key]; };

  function clear() {
    scene.traverse((thing) => {
      if (thing.geometry) thing.geometry.dispose();
      if (thing.material) thing.material.dispose();
      if (thing.isInstancedMesh) thing.dispose();
    });
    scene.clear();
    groups = {};
    meshes = [];
    surfels = null;
  }

  function colourSurfels(kind) {
    colourKind = kind;
    if (!surfels) return;
    const colour = new THREE.Color();
    surfelValues(surfels.position, kind, L).forEach((v, i) => {
      const [r, g, b] = Number.isFinite(v) ? L.ramp(v) : kColoursOfNothing;
      surfels.mesh.setColorAt(i, colour.setRGB(r / 255, g / 255, b / 255, THREE.SRGBColorSpace));
    });
    surfels.mesh.instanceColor.needsUpdate = true;
    render();
  }

  // The camera stays where it is when a map grows; its place on screen may only move with the map's middle.
  function recentre() {
    const old = origin, now = contents(L);
    ({ origin, reach, extent } = now);
    camera.near = reach / 2000;
    camera.far = reach * 20;
    fly.setSpeed(reach / 4);
    if (old && moved) {
      const shift = old.clone().sub(origin);
      camera.position.add(shift);
      controls.target.add(shift);
    }
    camera.updateProjectionMatrix();
  }

  function draw() {
    clear();
    recentre();
    for (const [key, mesh, line] of planesOf(L, origin)) {
      group(key).add(mesh, line);
      meshes.push(mesh);
    }
    for (const [key, line] of linesOf(L, origin)) group(key).add(line);
    if (L.keyframes) group('keyframes').add(keyframesOf(L, origin, 0.018 * reach));
    if (L.data.edges && L.data.edges.count) group('edges').add(pointsOf(L.data.edges, L, origin, L.tracks.edges, 5));
    if (L.data.surfels && L.data.surfels.count) {
      surfels = surfelsOf(L.data.surfels, L, origin);
      group('surfels').add(surfels.mesh);
      colourSurfels(L.data.grid ? colourKind : 'height');
    }
    if (!moved) home();
    render();
  }

  // From this direction, as near as everything fits.
  const look = (x, y, z) => {
    fly.stop();
    controls.enabled = true;
    controls.target.set(0, 0, 0);
    const p = new THREE.Vector3();
    const fits = (distance) => {
      camera.position.set(x, y, z).setLength(distance);
      camera.lookAt(0, 0, 0);
      camera.updateMatrixWorld();
      return extent.every((corner) => {
        p.copy(corner).project(camera);
        return Math.abs(p.x) < 0.94 && Math.abs(p.y) < 0.94 && p.z < 1;
      });
    };
    let near = 0.2 * reach, far = 6 * reach;
    for (let i = 0; i < 20; ++i) {
      const middle = (near + far) / 2;
      if (fits(middle)) far = middle; else near = middle;
    }
    fits(far);
    controls.update();
    render();
  };
  const home = () => { look(0.55, -0.95, 0.9); moved = false; };
  const resize = () => {
    const wide = Math.max(200, host.clientWidth), high = Math.round(Math.min(520, Math.max(280, 0.62 * wide)));
    renderer.setPixelRatio(Math.min(2, window.devicePixelRatio || 1));
    renderer.setSize(wide, high, false);
    canvas.style.height = `${high}px`;
    camera.aspect = wide / high;
    camera.updateProjectionMatrix();
    render();
  };
  const paint = () => { scene.background = new THREE.Color(dark.matches ? 0x16191c : 0xfbfbf8); render(); };

  function chooseAt(x, y) {
    const area = canvas.getBoundingClientRect();
    const ray = new THREE.Raycaster();
    ray.setFromCamera(new THREE.Vector2((x - area.left) / area.width * 2 - 1, 1 - (y - area.top) / area.height * 2), camera);
    const hit = ray.intersectObjects(meshes.filter((m) => m.parent.visible), false)[0];
    if (hit) L.choose(hit.object.userData.plane.id);
  }
  let down = null;
  canvas.addEventListener('pointerdown', (e) => { down = [e.clientX, e.clientY]; });
  canvas.addEventListener('pointerup', (e) => {
    if (down && Math.hypot(e.clientX - down[0], e.clientY - down[1]) <= 4) chooseAt(e.clientX, e.clientY);
  });
  for (const event of ['pointerdown', 'wheel', 'keydown']) canvas.addEventListener(event, () => { moved = true; }, { passive: true });
  window.addEventListener('resize', resize);
  dark.addEventListener('change', paint);
  resize();
  paint();

  // Where a point of the map is in the window, for who wants to click on it.
  const place = (x, y, z) => {
    const p = new THREE.Vector3(x, y, z).sub(origin).project(camera), area = canvas.getBoundingClientRect();
    return [area.left + (p.x + 1) / 2 * area.width, area.top + (1 - p.y) / 2 * area.height];
  };
  return {
    draw, place, colourSurfels, hold: fly.hold,
    planeCount: () => new Set(meshes.map((m) => m.userData.plane.id)).size,
    setVisible: (key, on) => {
      if (key === 'points' && on && !groups.points && L.data.points) group('points').add(pointsOf(L.data.points, L, origin, L.tracks.points, 1.5));
      if (groups[key]) { groups[key].visible = on; render(); }
    },
    orbit: home,
    top: () => { look(0, -0.001, 1); moved = true; },
    fly: () => { controls.enabled = false; moved = true; fly.start(); },
    choose: (plane) => { meshes.forEach((m) => { m.material.opacity = m.userData.plane === plane ? 0.9 : m.userData.opacity; }); render(); },
  };
};
