// Layer switches, and the 3D view where there is WebGL.
'use strict';
(() => {
  const { data, planes, labels, colours, tracks, el } = Lamina;

  let view = null;
  const host = document.getElementById('view3d');
  try {
    if (window.laminaView3d) view = window.laminaView3d(host, Lamina);
  } catch (problem) {
    host.replaceChildren();  // no WebGL: the plan shows the same
    document.body.dataset.webgl = 'no';
  }

  const shown = labels.filter((label) => planes.some((p) => Lamina.label(p) === label));
  const items = shown.map((label) => [label, label, colours[label], label !== 'ceiling']);
  if (Lamina.trajectory) items.push(['trajectory', 'trajectory', tracks.trajectory, true]);
  if (Lamina.before) items.push(['before', 'before refinement', tracks.before, false]);
  if (data.path) items.push(['path', 'planned path', tracks.path, true]);
  if (view && data.surfels && data.surfels.count) items.push(['surfels', 'floor surfels', '#35b779', true]);
  const set = (key, on) => {
    Lamina.plan.setVisible(key, on);
    if (view) view.setVisible(key, on);
  };
  for (const [key, text, colour, on] of items) {
    const box = el('input', { type: 'checkbox', checked: on, change: (e) => set(key, e.target.checked), 'data-layer': key });
    document.getElementById('toggles').append(el('label', {}, box, el('span', { class: 'swatch', style: `background:${colour}` }), text));
    set(key, on);
  }

  if (view) {
    const button = (text, click) => el('button', { type: 'button', click }, text);
    document.getElementById('view-buttons').append(button('Orbit', () => view.orbit()), button('From above', () => view.top()));
    if (data.surfels && data.surfels.count && data.grid) {
      const select = el('select', { 'aria-label': 'Surfels coloured by', change: (e) => view.colourSurfels(e.target.value) },
        el('option', { value: 'height' }, 'surfels by height'), el('option', { value: 'navigability' }, 'surfels by navigability'));
      document.getElementById('view-buttons').append(select);
    }
    Lamina.choosers.push((plane) => view.choose(plane));
  } else {
    document.getElementById('no3d').hidden = false;
  }
  // report.html#plane=7 opens with that plane chosen.
  const chooseLinked = () => {
    const link = /^#plane=(-?\d+)$/.exec(location.hash);
    if (link) Lamina.choose(Number(link[1]));
  };
  window.addEventListener('hashchange', chooseLinked);
  chooseLinked();
  document.body.dataset.planes = document.querySelectorAll('#planes tbody tr').length;
  document.body.dataset.planes3d = view ? view.planeCount : 0;
  document.body.dataset.ready = 'true';
})();
