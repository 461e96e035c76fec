// The map in plain words, the chosen plane's numbers, and the table of all planes.
'use strict';
(() => {
  const { labels, colours, el, button, number, degrees, duration, cells } = Lamina;
  const metres = (v) => (Math.abs(v) < 0.01 ? `${(1000 * v).toFixed(1)} mm` : Math.abs(v) < 1 ? `${(100 * v).toFixed(1)} cm` : number(v, 'm'));
  const count = (n, one, many = one + 's') => `${n} ${n === 1 ? one : many}`;
  const area = (v) => (v < 10 ? v.toFixed(1) : v.toFixed(0)) + ' m\u00b2';
  const metrics = () => Lamina.data.metrics || {};
  const counts = () => metrics().counts || {};

  // Heights of floor planes, gathered where the next is less than 0.3 m higher.
  function floorLevels() {
    const heights = Lamina.planes.filter((p) => p.label === 'floor' && p.outlines.length).map((p) => {
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

  // Square metres of the grid: known height, free, blocked, seen but not told.
  function ground() {
    const grid = Lamina.data.grid;
    if (!grid) return null;
    const size = grid.width * grid.height, cell = grid.resolution ** 2;
    const height = cells(grid.layers.height.codes, size);
    const { least, largest, codes } = grid.layers.navigability;
    const can = cells(codes, size);
    const { surfels } = Lamina.data, stages = metrics().stages || {};
    // Walls have heights, too: a sensor that looks at the floor leaves surfels.
    const sum = { seen: 0, free: 0, blocked: 0, unsure: 0, looked: Boolean((surfels && surfels.count) || stages.floor) };
    for (let k = 0; k < size; ++k) {
      if (can[k] !== 255) sum[least + can[k] / 254 * (largest - least) > 0 ? 'free' : 'blocked'] += cell;
      else if (height[k] !== 255) sum.unsure += cell;
    }
    sum.seen = sum.free + sum.blocked + sum.unsure;
    return sum;
  }

  // Edge points less than 0.3 m apart are of one place.
  function edgePlaces() {
    const e = Lamina.data.edges;
    if (!e) return null;
    const reach = 0.3, at = Lamina.points(e), n = e.count, boxes = new Map(), seen = new Uint8Array(n);
    const key = (i, j) => `${i},${j}`;
    const cell = (p) => [0, 1].map((k) => Math.floor(at[3 * p + k] / reach));
    for (let p = 0; p < n; ++p) {
      const name = key(...cell(p));
      boxes.set(name, [...(boxes.get(name) || []), p]);
    }
    const places = [];
    for (let first = 0; first < n; ++first) {
      if (seen[first]) continue;
      const place = [], open = [first];
      seen[first] = 1;
      while (open.length) {
        const p = open.pop(), [i, j] = cell(p);
        place.push(p);
        for (let a = i - 1; a <= i + 1; ++a) {
          for (let b = j - 1; b <= j + 1; ++b) {
            for (const q of boxes.get(key(a, b)) || []) {
              if (seen[q] || Math.hypot(at[3 * p] - at[3 * q], at[3 * p + 1] - at[3 * q + 1]) > reach) continue;
              seen[q] = 1;
              open.push(q);
            }
          }
        }
      }
      const mean = [0, 1].map((k) => place.reduce((s, p) => s + at[3 * p + k], 0) / place.length);
      if (place.length >= 3) places.push({ size: place.length, mean });
    }
    return places.sort((a, b) => b.size - a.size);
  }

  function holesText(places) {
    if (!places.length) return 'No hole, ledge or stair going down was seen.';
    const where = places.slice(0, 4).map((p) => `(${p.mean.map((v) => v.toFixed(1)).join(', ')})`).join(', ');
    return `The floor ends at ${count(places.length, 'place')} (holes, ledges or stairs going down), around ${where}`
      + (places.length > 4 ? ` and ${places.length - 4} more.` : '.');
  }

  function groundText(g) {
    if (!g.looked) return `No sensor looked at the floor. At the height of the scanner ${g.free > 0 ? `${area(g.free)} are clear and ` : ''}${area(g.blocked)} are walls.`;
    return `${area(g.seen)} of ground are mapped: ${area(g.free)} free, ${area(g.blocked)} blocked, ${area(g.unsure)} not sure enough to tell.`;
  }

  function facts(g) {
    const { planes, trajectory: t, data } = Lamina, out = [];
    if (t && t.count) {
      out.push(`The sensor went ${number(t.length, 'm')} in ${duration(t.times[t.count - 1] - t.times[0])} `
        + `(${count(t.total, 'pose')}${Lamina.keyframes ? `, ${count(Lamina.keyframes.total, 'keyframe')}` : ''}).`);
    }
    if (g && g.seen) out.push(groundText(g));
    const each = labels.map((l) => [l, planes.filter((p) => Lamina.label(p) === l).length]).filter(([, n]) => n).map(([l, n]) => `${n} ${l}`);
    out.push(`${count(planes.length, 'plane')}${each.length ? ': ' + each.join(', ') : ''}.`);
    const levels = floorLevels();
    if (levels.length) {
      out.push(`${count(levels.length, 'floor level')}: ${levels.slice(0, 8).map((l) => `${(Math.round(100 * l.z) / 100 + 0).toFixed(2)} m (${area(l.area)})`).join(', ')}`
        + (levels.length > 8 ? ` and ${levels.length - 8} more.` : '.'));
    } else if (planes.length) out.push('No plane was taken for a floor.');
    const places = edgePlaces();
    if (places) out.push(holesText(places));
    const refine = metrics().refine;
    if (refine) {
      out.push(`The whole map was refined in ${number(refine.solve_s, 's')} (${count(refine.iterations, 'iteration')}, `
        + `${refine.status.replace(/_/g, ' ')}); that moved the poses by ${metres(refine.moved_rms_m)} rms.`);
    }
    const ate = data.evaluation && data.evaluation.trajectory && data.evaluation.trajectory.ate_m;
    if (ate) out.push(`Against the reference: ${metres(ate.rmse)} rms error of position, ${metres(ate.max)} at most.`);
    return out;
  }

  function worries(g) {
    const { planes, data, trajectory: t } = Lamina, out = [], c = counts(), refine = metrics().refine;
    if (data.live && data.live.doing !== 'finished') return ['The map is still growing: figures are those of this moment.'];
    for (const warning of metrics().warnings || []) out.push(`${warning.text}.`);
    const assumed = metrics().assumed || [];
    if (assumed.length) out.push(`Assumed, as nothing states it: ${assumed.join('; ')}.`);
    if (data.metrics && !refine) out.push('The map was not refined as a whole: lamina refine does that.');
    if (refine && refine.status !== 'converged') out.push(`Refinement did not converge (${refine.status.replace(/_/g, ' ')}): the map may still be bent.`);
    if (c.steps_with_tracking_lost) out.push(`Tracking was lost ${count(c.steps_with_tracking_lost, 'time')}, first after ${(c.tracking_lost_after_s ?? 0).toFixed(1)} s: the map may be torn there.`);
    if (c.steps_with_unknown_motion > 1) out.push(`Nothing measured the motion before ${count(c.steps_with_unknown_motion, 'step')}: constant speed was assumed.`);
    if (t && t.length > 50 && data.metrics && !c.loops && !c.scan_loops) {
      out.push('No place was recognised again: drift along the path could not be corrected.');
    }
    if (c.rejected_factors) out.push(`${count(c.rejected_factors, 'constraint')} contradicted the rest and were left out.`);
    const vague = planes.filter((p) => p.area > 1 && (p.own_sigma_rho > 0.05 || p.own_sigma_angle > 0.05)).length;
    if (vague) out.push(`${count(vague, 'plane')} of more than 1 m\u00b2 are known worse than 5 cm or 3\u00b0.`);
    const open = planes.filter((p) => p.unobserved).length;
    if (open) out.push(`${open} of ${count(planes.length, 'plane')} are not measured in every direction: planes seen by 2D scans alone are taken as upright.`);
    if (g && !g.looked && g.seen) out.push('Steps and holes could not be seen: no depth sensor looked at the floor.');
    if (g && g.looked && g.unsure > 0.1 * g.seen) out.push(`${(100 * g.unsure / g.seen).toFixed(0)} % of the ground seen is not sure enough to call free or blocked: planners take it as unknown.`);
    for (const [why, n] of Object.entries(metrics().skipped || {})) out.push(`Skipped ${count(n, 'time')}: ${why}.`);
    for (const remark of (data.evaluation && data.evaluation.remarks) || []) out.push(String(remark));
    for (const key of ['grid', 'occupancy']) {
      if (data[key] && data[key].step > 1) out.push(`Drawn here with every ${data[key].step}. row and column: ${key}.`);
    }
    for (const key of ['trajectory', 'surfels', 'points', 'keyframes', 'edges']) {
      if (data[key] && data[key].count < data[key].total) out.push(`${data[key].count} of ${data[key].total} drawn here: ${key}.`);
    }
    return out;
  }

  // The few figures that people ask for first.
  function tiles(g) {
    const { trajectory: t, planes, data } = Lamina;
    const ate = data.evaluation && data.evaluation.trajectory && data.evaluation.trajectory.ate_m;
    const list = [t && t.count && ['path', number(t.length, 'm')], t && t.count && ['time', duration(t.times[t.count - 1] - t.times[0])],
      ['planes', String(planes.length)], g && g.free > 0 && [g.looked ? 'free ground' : 'clear area', area(g.free)],
      ate && ['error, rms', metres(ate.rmse)]];
    return list.filter(Boolean).map(([name, value]) => el('div', { class: 'tile' }, el('b', {}, value), el('span', {}, name)));
  }

  function drawSummary() {
    const name = Lamina.data.name || 'map', g = ground(), worried = worries(g);
    document.getElementById('title').textContent = `Map ${name}`;
    document.title = `${name} \u2013 lamina map`;
    document.getElementById('tiles').replaceChildren(...tiles(g));
    document.getElementById('summary').replaceChildren(...facts(g).map((text) => el('li', {}, text)));
    document.getElementById('worries').replaceChildren(...(worried.length ? worried.map((text) => el('li', { class: 'worry' }, text))
      : [el('li', {}, 'Nothing stands out.')]));
  }

  const rows = (p) => [['id', p.id], ['label', p.label], ['\u03c1', `${number(p.rho, 'm')} \u00b1 ${number(p.sigma_rho, 'm')}`],
    ['\u03b8', `${degrees(p.theta)} \u00b1 ${degrees(p.sigma_angle)}`], ['\u03c6', `${degrees(p.phi)} \u00b1 ${degrees(p.sigma_angle / Math.max(1e-3, Math.sin(p.theta)))}`],
    ['area', number(p.area, 'm\u00b2')], ['observations', p.observations],
    ...(p.unobserved ? [['not measured', `${p.unobserved} of 3 directions`]] : [])];
  Lamina.choosers.push((p) => {
    const chosen = document.getElementById('chosen');
    chosen.replaceChildren(el('h3', {}, el('span', { class: 'swatch', style: `background:${colours[Lamina.label(p)]}` }), `Plane ${p.id}`),
      el('table', {}, ...rows(p).map(([name, value]) => el('tr', {}, el('th', { scope: 'row' }, name), el('td', {}, String(value))))));
    chosen.dataset.plane = p.id;
  });

  const head = ['plane', 'label', '\u03c1 (m)', '\u03c3\u03c1 (m)', '\u03b8', '\u03c6', '\u03c3 angle', 'area (m\u00b2)', 'observations'];
  const line = (p) => el('tr', { 'data-plane': p.id },
    el('td', {}, button(String(p.id), () => Lamina.choose(p.id))),
    ...[p.label, number(p.rho), number(p.sigma_rho), degrees(p.theta), degrees(p.phi), degrees(p.sigma_angle),
      number(p.area), p.observations].map((value) => el('td', {}, String(value))));
  const drawTable = () => document.getElementById('planes').replaceChildren(el('table', {},
    el('thead', {}, el('tr', {}, ...head.map((h) => el('th', { scope: 'col' }, h)))),
    el('tbody', {}, ...Lamina.planes.map(line))));

  Lamina.parts.push(drawSummary, drawTable);
})();
