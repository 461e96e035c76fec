// What the other scripts share: the data, its arrays, elements, colours, numbers.
'use strict';
const Lamina = (() => {
  window.addEventListener('error', (e) => { document.body.dataset.error = e.message; });
  const data = JSON.parse(document.getElementById('data').textContent);

  const bytes = (text) => Uint8Array.from(atob(text), (c) => c.charCodeAt(0));
  const floats = (text) => {
    const raw = new DataView(bytes(text).buffer);
    return Float32Array.from({ length: raw.byteLength / 4 }, (_, i) => raw.getFloat32(4 * i, true));
  };
  const track = (t) => t && { ...t, times: floats(t.times), positions: floats(t.positions) };

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
  const tracks = { trajectory: '#d55e00', before: '#8a8f94', path: '#d55e00' };
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
    const text = size >= 100 || Number.isInteger(value) ? value.toFixed(0)
      : size >= 1 ? value.toFixed(2) : size >= 1e-3 || size === 0 ? value.toFixed(4) : value.toExponential(1);
    return unit ? `${text} ${unit}` : text;
  };
  const degrees = (radians) => number(radians * 180 / Math.PI, '\u00b0');

  return {
    data, bytes, floats, el, svg, colours, tracks, ramp, number, degrees,
    planes: data.planes, labels: Object.keys(colours),
    trajectory: track(data.trajectory), before: track(data.before),
    label: (plane) => (colours[plane.label] ? plane.label : 'other'),
    choosers: [],  // each is called with the plane that was chosen
    choose(id) {
      const plane = Lamina.planes.find((p) => p.id === id);
      if (plane) Lamina.choosers.forEach((call) => call(plane));
    },
  };
})();
