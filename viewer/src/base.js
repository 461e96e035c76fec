// What the other scripts share: the data, its arrays, elements, colours, numbers.
'use strict';
const Lamina = (() => {
  window.addEventListener('error', (e) => { document.body.dataset.error = e.message; });

  const bytes = (text) => Uint8Array.from(atob(text), (c) => c.charCodeAt(0));
  const floats = (text) => {
    const raw = new DataView(bytes(text).buffer);
    return Float32Array.from({ length: raw.byteLength / 4 }, (_, i) => raw.getFloat32(4 * i, true));
  };
  // Undoes run_lengths() of viewer/encode.hpp.
  const cells = (text, count) => {
    const from = bytes(text), to = new Uint8Array(count);
    for (let i = 0, k = 0; i < from.length;) {
      const c = from[i++];
      if (c < 128) { to.set(from.subarray(i, i + c + 1), k); i += c + 1; k += c + 1; }
      else { to.fill(from[i++], k, k + c - 125); k += c - 125; }
    }
    return to;
  };
  const track = (t) => t && { ...t, times: floats(t.times), positions: floats(t.positions) };
  // Positions, three numbers each, of points_text() in viewer/parts.hpp.
  const points = (p) => {
    const raw = new DataView(bytes(p.codes).buffer);
    return Float32Array.from({ length: 3 * p.count }, (_, i) => p.origin[i % 3] + p.step * raw.getUint16(2 * i, true));
  };

  const fill = (node, attributes, children) => {
    for (const [key, value] of Object.entries(attributes || {})) {
      if (typeof value === 'function') node.addEventListener(key, value);
      else if (value !== false && value != null) node.setAttribute(key, value === true ? '' : value);
    }
    node.append(...children.filter((c) => c != null));
    return node;
  };
  const el = (name, attributes, ...children) => fill(document.createElement(name), attributes, children);
  const svg = (name, attributes, ...children) =>
    fill(document.createElementNS(document.documentElement.namespaceURI.replace('1999/xhtml', '2000/svg'), name),
      attributes, children);

  // Okabe and Ito's colours, told apart with any colour vision.
  const colours = { floor: '#009e73', ramp: '#56b4e9', step: '#e69f00', wall: '#0072b2', ceiling: '#cc79a7', other: '#8a8f94' };
  const tracks = { trajectory: '#d55e00', before: '#8a8f94', path: '#d55e00', keyframes: '#e69f00', points: '#8a8f94', edges: '#cc79a7' };
  // Viridis at ten places.
  const stops = [[68, 1, 84], [72, 40, 120], [62, 74, 137], [49, 104, 142], [38, 130, 142], [31, 158, 137],
    [53, 183, 121], [110, 206, 88], [181, 222, 43], [253, 231, 37]];
  const ramp = (part) => {
    const at = Math.min(1, Math.max(0, part)) * (stops.length - 1);
    const i = Math.min(stops.length - 2, Math.floor(at));
    return stops[i].map((c, k) => Math.round(c + (at - i) * (stops[i + 1][k] - c)));
  };

  // Three or four figures; 'unknown' for what is not there.
  const number = (value, unit = '') => {
    if (value == null || !Number.isFinite(value)) return 'unknown';
    const size = Math.abs(value);
    const text = size >= 1e5 ? value.toPrecision(3).replace('e+', 'e') : size >= 100 || Number.isInteger(value) ? value.toFixed(0)
      : size >= 1 ? value.toFixed(2) : size >= 1e-3 || size === 0 ? value.toFixed(4) : value.toExponential(1);
    return unit ? `${text} ${unit}` : text;
  };
  const degrees = (radians) => number(radians * 180 / Math.PI, '\u00b0');
  const duration = (s) => (s < 120 ? number(s, 's') : s < 7200 ? `${Math.floor(s / 60)} min ${Math.round(s % 60)} s`
    : `${Math.floor(s / 3600)} h ${Math.round(s % 3600 / 60)} min`);
  const button = (text, click, attributes) => el('button', { type: 'button', click, ...attributes }, text);

  const L = {
    bytes, floats, cells, points, el, svg, button, colours, tracks, ramp, number, degrees, duration,
    labels: Object.keys(colours),
    label: (plane) => (colours[plane.label] ? plane.label : 'other'),
    parts: [],     // each draws its part of the page anew from the data
    choosers: [],  // each is called with the plane that was chosen
    visible: {},   // layers switched by hand, by key
    chosen: null,  // id of the plane
    choose(id) {
      const plane = L.planes.find((p) => p.id === id);
      if (!plane) return;
      L.chosen = id;
      L.choosers.forEach((call) => call(plane));
    },
    load(data) {
      Object.assign(L, { data, planes: data.planes, trajectory: track(data.trajectory), before: track(data.before) });
      const k = data.keyframes;
      L.keyframes = k && k.count ? { ...k, poses: floats(k.poses) } : null;
    },
    refresh() {
      L.parts.forEach((draw) => draw());
      if (L.chosen != null) L.choose(L.chosen);
      document.body.dataset.planes = document.querySelectorAll('#planes tbody tr').length;
    },
  };
  L.load(JSON.parse(document.getElementById('data').textContent));
  return L;
})();
