// The map in plain words, the chosen plane's numbers, and the table of all planes.
'use strict';
(() => {
  const { data, planes, labels, colours, el, number, degrees, bytes } = Lamina;
  const counts = (data.metrics && data.metrics.counts) || {};
  const skipped = (data.metrics && data.metrics.skipped) || {};

  // Heights of floor planes, gathered where the next is less than 0.3 m higher.
  function floorLevels() {
    const heights = planes.filter((p) => p.label === 'floor' && p.outlines.length).map((p) => {
      const outline = p.outlines[0];
      return { z: outline.reduce((sum, q) => sum + q[2], 0) / outline.length, area: p.area };
    }).sort((a, b) => a.z - b.z);
    const levels = [];
    let last = -Infinity;
    for (const h of heights) {
      if (h.z - last > 0.3) levels.push({ z: 0, area: 0 });
      const level = levels[levels.length - 1];
      level.z = (level.z * level.area + h.z * h.area) / ((level.area + h.area) || 1);
      level.area += h.area;
      last = h.z;
    }
    return levels;
  }

  function knownArea() {
    if (!data.grid) return null;
    const known = bytes(data.grid.layers.height.codes).reduce((n, code) => n + (code !== 255), 0);
    return known * data.grid.resolution ** 2;
  }

  function facts() {
    const out = [];
    if (Lamina.trajectory) {
      const t = Lamina.trajectory;
      const span = t.count ? t.times[t.count - 1] - t.times[0] : 0;
      out.push(`The sensor went ${number(t.length, 'm')} in ${number(span, 's')} (${t.total} poses).`);
    }
    const area = knownArea();
    if (area != null) out.push(`${number(area, 'm\u00b2')} of ground are mapped.`);
    const each = labels.map((l) => [l, planes.filter((p) => Lamina.label(p) === l).length])
      .filter(([, n]) => n).map(([l, n]) => `${n} ${l}`);
    out.push(`${planes.length} planes${each.length ? ': ' + each.join(', ') : ''}.`);
    const levels = floorLevels();
    if (levels.length) {
      out.push(`Floor at ${levels.slice(0, 8).map((l) => `${(Math.round(100 * l.z) / 100 + 0).toFixed(2)} m (${number(l.area, 'm\u00b2')})`).join(', ')}`
        + (levels.length > 8 ? ` and ${levels.length - 8} more heights.` : '.'));
    } else if (planes.length) out.push('No plane was taken for a floor.');
    const voids = Object.entries(counts).filter(([k]) => /hole|rim/.test(k));
    if (voids.length) out.push(`Found: ${voids.map(([k, n]) => `${n} ${k.replace(/_/g, ' ')}`).join(', ')}.`);
    const refine = data.metrics && data.metrics.refine;
    if (refine) {
      out.push(`The whole map was refined in ${number(refine.solve_s, 's')} (${refine.iterations} iterations, `
        + `${refine.status.replace(/_/g, ' ')}); poses moved by ${number(refine.moved_rms_m, 'm')} rms.`);
    }
    const ate = data.evaluation && data.evaluation.trajectory && data.evaluation.trajectory.ate_m;
    if (ate) out.push(`Against the reference: ${number(ate.rmse, 'm')} rms error of position, ${number(ate.max, 'm')} at most.`);
    return out;
  }

  function worries() {
    const out = [];
    const refine = data.metrics && data.metrics.refine;
    if (data.metrics && !refine) out.push('The map was not refined as a whole.');
    if (refine && refine.status !== 'converged') out.push(`Refinement did not converge (${refine.status.replace(/_/g, ' ')}).`);
    for (const [why, n] of Object.entries(skipped)) out.push(`Skipped ${n} ${n === 1 ? 'time' : 'times'}: ${why}.`);
    if (counts.rejected_factors) out.push(`Constraints that contradicted the rest and were left out: ${counts.rejected_factors}.`);
    if (counts.steps_with_unknown_motion) out.push(`Steps whose motion is unknown: ${counts.steps_with_unknown_motion}.`);
    const open = planes.filter((p) => p.unobserved).length;
    if (open) out.push(`${open} of ${planes.length} planes are not measured in every direction.`);
    for (const remark of (data.evaluation && data.evaluation.remarks) || []) out.push(String(remark));
    if (data.grid && data.grid.step > 1) out.push(`Grids are shown with every ${data.grid.step}. row and column.`);
    for (const key of ['trajectory', 'surfels']) {
      if (data[key] && data[key].count < data[key].total) out.push(`${data[key].count} of ${data[key].total} shown: ${key}.`);
    }
    return out;
  }

  document.getElementById('title').textContent = `Map ${data.name}`;
  document.title = `${data.name} \u2013 lamina map`;
  document.getElementById('summary').append(...facts().map((text) => el('li', {}, text)),
    ...worries().map((text) => el('li', { class: 'worry' }, text)));

  const rows = (p) => [['id', p.id], ['label', p.label], ['\u03c1', `${number(p.rho, 'm')} \u00b1 ${number(p.sigma_rho, 'm')}`],
    ['\u03b8', degrees(p.theta)], ['\u03c6', degrees(p.phi)], ['\u03c3 of the angles', degrees(p.sigma_angle)],
    ['area', number(p.area, 'm\u00b2')], ['observations', p.observations]];
  Lamina.choosers.push((p) => {
    const chosen = document.getElementById('chosen');
    chosen.replaceChildren(el('h3', {}, el('span', { class: 'swatch', style: `background:${colours[Lamina.label(p)]}` }), `Plane ${p.id}`),
      el('table', {}, ...rows(p).map(([name, value]) => el('tr', {}, el('th', {}, name), el('td', {}, String(value))))));
    chosen.dataset.plane = p.id;
  });

  const head = ['plane', 'label', '\u03c1 (m)', '\u03c3\u03c1 (m)', '\u03b8', '\u03c6', '\u03c3 angle', 'area (m\u00b2)', 'observations'];
  const line = (p) => el('tr', { 'data-plane': p.id },
    el('td', {}, el('button', { type: 'button', click: () => Lamina.choose(p.id) }, String(p.id))),
    ...[p.label, number(p.rho), number(p.sigma_rho), degrees(p.theta), degrees(p.phi), degrees(p.sigma_angle),
      number(p.area), p.observations].map((value) => el('td', {}, String(value))));
  document.getElementById('planes').append(el('table', {},
    el('thead', {}, el('tr', {}, ...head.map((h) => el('th', { scope: 'col' }, h)))),
    el('tbody', {}, ...planes.map(line))));
})();
