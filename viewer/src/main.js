// Layer switches, and the 3D view where there is WebGL. Draws everything the first time.
'use strict';
(() => {
  const { labels, colours, tracks, el, button } = Lamina;

  let view = null;
  const host = document.getElementById('view3d');
  try {
    if (window.laminaView3d) view = window.laminaView3d(host, Lamina);
  } catch (problem) {
    host.replaceChildren();  // no WebGL: the plan shows the same
    document.body.dataset.webgl = 'no';
  }

  // [key, words, colour, shown at first]
  function layers() {
    const { data, planes } = Lamina;
    const items = labels.filter((label) => planes.some((p) => Lamina.label(p) === label))
      .map((label) => [label, label, colours[label], label !== 'ceiling']);
    const add = (there, key, words, colour, on) => { if (there) items.push([key, words, colour, on]); };
    add(Lamina.trajectory, 'trajectory', 'trajectory', tracks.trajectory, true);
    add(Lamina.before, 'before', 'before refinement', tracks.before, false);
    add(Lamina.keyframes, 'keyframes', 'keyframes', tracks.keyframes, false);
    add(data.edges && data.edges.count, 'edges', 'where floor ends', tracks.edges, true);
    add(data.path, 'path', 'planned path', tracks.path, true);
    add(view && data.surfels && data.surfels.count, 'surfels', 'floor surfels', '#35b779', true);
    add(data.points && data.points.count, 'points', 'scan points', tracks.points, false);
    return items;
  }

  const set = (key, on) => {
    Lamina.plan.setVisible(key, on);
    if (view) view.setVisible(key, on);
  };
  function drawToggles() {
    const box = document.getElementById('toggles');
    const focused = box.contains(document.activeElement) ? document.activeElement.dataset.layer : null;
    box.replaceChildren(el('legend', {}, 'Show'));
    for (const [key, text, colour, first] of layers()) {
      const on = Lamina.visible[key] ?? first;
      const input = el('input', { type: 'checkbox', checked: on, 'data-layer': key,
        change: (e) => { Lamina.visible[key] = e.target.checked; set(key, e.target.checked); } });
      box.append(el('label', {}, input, el('span', { class: 'swatch', style: `background:${colour}` }), text));
      set(key, on);
      if (key === focused) input.focus();
    }
  }

  function addViewButtons() {
    const bar = document.getElementById('view-buttons');
    const modes = { Orbit: () => view.orbit(), Fly: () => view.fly(), 'From above': () => view.top() };
    const buttons = Object.entries(modes).map(([text, go]) => button(text, () => {
      go();
      buttons.forEach((b) => b.setAttribute('aria-pressed', String(b.textContent === text)));
      document.getElementById('fly-keys').hidden = text !== 'Fly';
    }, { 'aria-pressed': String(text === 'Orbit') }));
    const colourBy = el('select', { 'aria-label': 'Floor surfels coloured by', change: (e) => view.colourSurfels(e.target.value) },
      el('option', { value: 'height' }, 'surfels by height'), el('option', { value: 'navigability' }, 'surfels by navigability'));
    bar.append(...buttons, colourBy);
    const pad = document.getElementById('fly-keys');
    const hold = (text, label, key) => button(text, () => {}, { 'aria-label': label, pointerdown: () => view.hold(key, true),
      pointerup: () => view.hold(key, false), pointerleave: () => view.hold(key, false),
      keydown: (e) => { if (e.key === 'Enter' || e.key === ' ') { view.hold(key, true); setTimeout(() => view.hold(key, false), 150); } } });
    pad.append(hold('\u25b2', 'fly ahead', 'w'), hold('\u25bc', 'fly back', 's'), hold('\u25c0', 'fly left', 'a'), hold('\u25b6', 'fly right', 'd'),
      hold('\u2912', 'fly up', 'e'), hold('\u2913', 'fly down', 'q'), el('span', {}, 'drag to look; keys W A S D, Q E, Shift for faster'));
    Lamina.parts.push(() => { colourBy.hidden = !(Lamina.data.surfels && Lamina.data.surfels.count && Lamina.data.grid); });
  }

  if (view) {
    addViewButtons();
    Lamina.parts.push(() => view.draw());
    Lamina.choosers.push((plane) => view.choose(plane));
    Lamina.view = view;
  } else {
    document.getElementById('no3d').hidden = false;
  }
  Lamina.parts.push(drawToggles, () => { document.body.dataset.planes3d = view ? view.planeCount() : 0; });
  Lamina.refresh();
  // report.html#plane=7 opens with that plane chosen.
  const chooseLinked = () => {
    const link = /^#plane=(-?\d+)$/.exec(location.hash);
    if (link) Lamina.choose(Number(link[1]));
  };
  window.addEventListener('hashchange', chooseLinked);
  chooseLinked();
  document.body.dataset.ready = 'true';
})();
