// The plan from above as SVG: planes, trajectories, keyframes, path. Needs no WebGL.
'use strict';
Lamina.plan = (() => {
  const { colours, tracks, svg, button } = Lamina;
  const points = (list) => list.map((p) => `${p[0].toFixed(3)},${p[1].toFixed(3)}`).join(' ');
  const flat = (t) => Array.from({ length: t.count }, (_, i) => [t.positions[3 * i], t.positions[3 * i + 1]]);

  function bounds() {
    const box = [Infinity, Infinity, -Infinity, -Infinity];
    const add = (p) => {
      box[0] = Math.min(box[0], p[0]); box[1] = Math.min(box[1], p[1]);
      box[2] = Math.max(box[2], p[0]); box[3] = Math.max(box[3], p[1]);
    };
    Lamina.planes.forEach((p) => p.outlines.forEach((o) => o.forEach(add)));
    if (Lamina.trajectory) flat(Lamina.trajectory).forEach(add);
    return box[0] <= box[2] ? box : [-1, -1, 1, 1];
  }

  let whole = null, seen = null, byHand = false;
  const groups = {};
  const up = svg('g', { transform: 'scale(1,-1)' });
  const root = svg('svg', { role: 'img', 'aria-label': 'Plan of the planes and the trajectory; arrow keys move it, plus and minus zoom', tabindex: 0 }, up);
  const show = () => root.setAttribute('viewBox', `${seen.x} ${seen.y} ${seen.w} ${seen.h}`);
  const zoom = (by) => {
    byHand = true;
    seen = { x: seen.x + seen.w * (1 - by) / 2, y: seen.y + seen.h * (1 - by) / 2, w: seen.w * by, h: seen.h * by };
    show();
  };
  const move = (dx, dy) => { byHand = true; seen.x += dx * seen.w; seen.y += dy * seen.h; show(); };

  // Ceilings below all else; what is large below what is small.
  function drawPlanes() {
    for (const label of ['ceiling', 'floor', 'ramp', 'step', 'other', 'wall']) {
      groups[label] = svg('g', {});
      const own = Lamina.planes.filter((p) => Lamina.label(p) === label).sort((a, b) => b.area - a.area);
      for (const p of own) {
        for (const outline of p.outlines) {
          groups[label].append(svg('polygon', {
            class: 'plane', 'data-plane': p.id, points: points(outline), fill: colours[label],
            'fill-opacity': label === 'ceiling' ? 0.06 : 0.3, stroke: colours[label], 'stroke-width': label === 'wall' ? 2.5 : 1,
            'vector-effect': 'non-scaling-stroke', click: () => Lamina.choose(p.id),
          }, svg('title', {}, `plane ${p.id}: ${p.label}`)));
        }
      }
      up.append(groups[label]);
    }
  }

  function drawLines() {
    const { data } = Lamina;
    const line = (key, list, dash) => {
      groups[key] = svg('polyline', {
        points: points(list), fill: 'none', stroke: tracks[key], 'stroke-width': key === 'path' ? 3 : 1.5,
        'stroke-dasharray': dash, 'vector-effect': 'non-scaling-stroke', 'pointer-events': 'none',
      });
      up.append(groups[key]);
    };
    const shape = (key, d, width) => up.append(groups[key] = svg('path', { d, fill: 'none', stroke: tracks[key], 'stroke-width': width,
      'stroke-linecap': 'round', 'vector-effect': 'non-scaling-stroke', 'pointer-events': 'none' }));
    if (Lamina.before) line('before', flat(Lamina.before), '4 3');
    if (Lamina.trajectory) line('trajectory', flat(Lamina.trajectory));
    if (Lamina.keyframes) {
      const { count, poses } = Lamina.keyframes, size = 0.006 * Math.max(whole.w, whole.h);
      const mark = (i) => {
        const [x, y, , a] = poses.subarray(4 * i, 4 * i + 4);
        return [[a, 1.6], [a + 2.5, 1], [a - 2.5, 1]].map(([b, s], k) =>
          `${k ? 'L' : 'M'}${(x + s * size * Math.cos(b)).toFixed(3)} ${(y + s * size * Math.sin(b)).toFixed(3)}`).join('') + 'Z';
      };
      shape('keyframes', Array.from({ length: count }, (_, i) => mark(i)).join(''), 1.5);
    }
    if (data.edges) {
      const at = Lamina.points(data.edges);
      shape('edges', Array.from({ length: data.edges.count }, (_, i) => `M${at[3 * i].toFixed(3)} ${at[3 * i + 1].toFixed(3)}h0`).join(''), 5);
    }
    if (data.path) line('path', data.path, '8 4');
  }

  // Scan points are drawn when first asked for: there are many.
  function drawPoints() {
    const at = Lamina.points(Lamina.data.points);
    up.prepend(groups.points = svg('path', { d: Array.from({ length: at.length / 3 }, (_, i) => `M${at[3 * i].toFixed(2)} ${at[3 * i + 1].toFixed(2)}h0`).join(''),
      fill: 'none', stroke: tracks.points, 'stroke-width': 1.5, 'stroke-linecap': 'round', 'vector-effect': 'non-scaling-stroke', 'pointer-events': 'none' }));
  }

  Lamina.parts.push(() => {
    const [x0, y0, x1, y1] = bounds();
    const margin = 0.05 * Math.max(x1 - x0, y1 - y0, 1);
    whole = { x: x0 - margin, y: -y1 - margin, w: x1 - x0 + 2 * margin, h: y1 - y0 + 2 * margin };
    if (!byHand) seen = { ...whole };
    up.replaceChildren();
    Object.keys(groups).forEach((key) => delete groups[key]);
    drawPlanes();
    drawLines();
    show();
  });

  Lamina.choosers.push((p) => root.querySelectorAll('polygon.plane').forEach((shape) =>
    shape.classList.toggle('chosen', shape.dataset.plane === String(p.id))));
  let held = null;
  root.addEventListener('pointerdown', (e) => { held = [e.clientX, e.clientY]; });
  root.addEventListener('pointermove', (e) => {
    if (!held || !e.buttons) return;
    const box = root.getBoundingClientRect();
    const scale = Math.max(seen.w / box.width, seen.h / box.height);
    move(-(e.clientX - held[0]) * scale / seen.w, -(e.clientY - held[1]) * scale / seen.h);
    held = [e.clientX, e.clientY];
  });
  const keys = { '+': () => zoom(0.8), '-': () => zoom(1.25), ArrowLeft: () => move(-0.1, 0), ArrowRight: () => move(0.1, 0),
    ArrowUp: () => move(0, -0.1), ArrowDown: () => move(0, 0.1) };
  root.addEventListener('keydown', (e) => { if (keys[e.key]) { keys[e.key](); e.preventDefault(); } });

  document.getElementById('plan').append(root);
  document.getElementById('plan-buttons').append(button('Closer', () => zoom(0.7)), button('Farther', () => zoom(1 / 0.7)),
    button('Whole map', () => { byHand = false; seen = { ...whole }; show(); }));
  return {
    flat, points,
    setVisible: (key, on) => {
      if (key === 'points' && on && !groups.points && Lamina.data.points) drawPoints();
      if (groups[key]) groups[key].style.display = on ? '' : 'none';
    },
  };
})();
