// The grids as pictures in tabs, with a legend and the values under the cursor.
'use strict';
(() => {
  const { el, svg, ramp, number, degrees, tracks } = Lamina;
  const says = {
    navigability: ['how well the robot can go there, 0 blocked to 1 free', (v) => number(v)],
    height: ['map z of the highest surface a robot would touch', (v) => number(v, 'm')],
    slope: ['slope of the ground', degrees],
    confidence: ['how sure the map is, 0 to 1', (v) => number(v)],
    occupancy: ['what the scans hit: dark occupied, light free', (v) => (v === 205 ? 'unknown' : v < 128 ? 'occupied' : 'free')],
  };
  let layers = {}, names = [], tabs = [], chosen = null;
  const add = (frame, name) => {
    const { least, largest, codes } = frame.layers[name];
    const raw = Lamina.cells(codes, frame.width * frame.height);
    const plain = name === 'occupancy';
    const value = (k) => (raw[k] === 255 && !plain ? NaN : plain ? raw[k] : least + raw[k] / 254 * (largest - least));
    layers[name] = { name, frame, raw, least, largest, value, plain };
  };

  function paint(layer) {
    const { width, height } = layer.frame;
    const canvas = el('canvas', { width, height, tabindex: 0, role: 'img', 'aria-label': `${layer.name}: arrow keys read single cells` });
    const context = canvas.getContext('2d');
    const image = context.createImageData(width, height);
    for (let k = 0; k < width * height; ++k) {
      const code = layer.raw[k];
      if (layer.plain ? code === 205 : code === 255) continue;
      image.data.set(layer.plain ? [code, code, code, 255] : [...ramp(code / 254), 255], 4 * k);
    }
    context.putImageData(image, 0, 0);
    return canvas;
  }

  function overlay(frame) {
    const s = frame.resolution;
    const pixel = ([x, y]) => [(x - frame.origin[0]) / s, frame.height - (y - frame.origin[1]) / s];
    const root = svg('svg', { viewBox: `0 0 ${frame.width} ${frame.height}`, preserveAspectRatio: 'none', 'aria-hidden': true });
    const line = (list, colour, width) => root.append(svg('polyline', {
      points: Lamina.plan.points(list.map(pixel)), fill: 'none', stroke: colour, 'stroke-width': width, 'vector-effect': 'non-scaling-stroke' }));
    if (Lamina.trajectory) line(Lamina.plan.flat(Lamina.trajectory), '#ffffffb0', 1);
    if (Lamina.data.path) { line(Lamina.data.path, '#000000', 5); line(Lamina.data.path, tracks.path, 3); }
    root.append(svg('rect', { class: 'cursor', width: 1, height: 1, fill: 'none', stroke: '#d55e00', 'stroke-width': 2,
      'vector-effect': 'non-scaling-stroke', visibility: 'hidden' }));
    return root;
  }

  function legend(layer) {
    const [text, show] = says[layer.name];
    const bar = layer.plain ? 'linear-gradient(90deg,#000,#fff)'
      : `linear-gradient(90deg,${[0, 1, 2, 3, 4, 5, 6, 7, 8, 9].map((i) => `rgb(${ramp(i / 9)})`).join(',')})`;
    return el('div', { class: 'legend' }, el('span', {}, layer.plain ? 'occupied' : show(layer.least)),
      el('div', { class: 'ramp', style: `background:${bar}` }), el('span', {}, layer.plain ? 'free' : show(layer.largest)),
      el('span', {}, el('span', { class: 'swatch', style: 'background:var(--unknown)' }), 'unknown'), el('span', {}, text));
  }

  function open(name) {
    chosen = name;
    const layer = layers[name];
    const { frame } = layer;
    const canvas = paint(layer);
    const lines = overlay(frame);
    const readout = el('p', { class: 'readout', 'aria-live': 'polite' }, 'Point at a cell, or focus the picture and use the arrow keys.');
    let at = [frame.width >> 1, frame.height >> 1];
    const read = () => {
      const [i, row] = at;
      const x = frame.origin[0] + (i + 0.5) * frame.resolution;
      const y = frame.origin[1] + (frame.height - row - 0.5) * frame.resolution;
      const values = names.filter((n) => layers[n].frame === frame)
        .map((n) => `${n} ${says[n][1](layers[n].value(row * frame.width + i))}`);
      readout.textContent = `x ${x.toFixed(2)} m, y ${y.toFixed(2)} m: ${values.join(', ')}`;
      const mark = lines.querySelector('.cursor');
      mark.setAttribute('x', i); mark.setAttribute('y', row); mark.setAttribute('visibility', 'visible');
    };
    canvas.addEventListener('pointermove', (e) => {
      const box = canvas.getBoundingClientRect();
      const part = [(e.clientX - box.left) / box.width, (e.clientY - box.top) / box.height];
      at = [frame.width, frame.height].map((n, k) => Math.min(n - 1, Math.max(0, Math.floor(part[k] * n))));
      read();
    });
    canvas.addEventListener('keydown', (e) => {
      const step = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] }[e.key];
      if (!step) return;
      e.preventDefault();
      at = [frame.width, frame.height].map((n, k) => Math.min(n - 1, Math.max(0, at[k] + step[k])));
      read();
    });
    const box = el('div', { class: 'grid-box', style: `background:var(--unknown);max-width:min(60rem, ${(70 * frame.width / frame.height).toFixed(1)}vh)` }, canvas, lines);
    document.getElementById('layer').replaceChildren(legend(layer), box, readout);
    tabs.forEach((tab) => {
      tab.setAttribute('aria-selected', String(tab.textContent === name));
      tab.tabIndex = tab.textContent === name ? 0 : -1;
    });
  }

  // Arrow keys go along the tabs, as people who use no mouse expect.
  const along = (e) => {
    const way = { ArrowRight: 1, ArrowLeft: -1 }[e.key];
    if (!way) return;
    const next = (names.indexOf(chosen) + way + names.length) % names.length;
    open(names[next]);
    tabs[next].focus();
    e.preventDefault();
  };

  Lamina.parts.push(() => {
    const { grid, occupancy } = Lamina.data;
    layers = {};
    if (grid) ['navigability', 'height', 'slope', 'confidence'].forEach((name) => add(grid, name));
    if (occupancy && occupancy.width * occupancy.height > 0) add(occupancy, 'occupancy');
    names = Object.keys(layers);
    document.getElementById('layer-section').hidden = !names.length;
    if (!names.length) return;
    tabs = names.map((name) => el('button', { type: 'button', role: 'tab', 'aria-controls': 'layer', click: () => open(name), keydown: along }, name));
    document.getElementById('tabs').replaceChildren(...tabs);
    // A map whose ground says nothing but where walls are opens with what the scans tell.
    const first = layers.occupancy && !(layers.navigability && layers.navigability.largest > 0) ? 'occupancy' : names[0];
    open(names.includes(chosen) ? chosen : first);
  });
})();
