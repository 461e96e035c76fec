// Charts as SVG: over time, stage times, residuals before and after.
'use strict';
(() => {
  const { el, svg, number } = Lamina;
  const box = document.getElementById('charts');
  const high = 220, left = 56, bottom = 34, top = 8, right = 10;
  let wide = 560;  // narrower on phones, so that words keep their size

  const figure = (title, ...content) => box.append(el('figure', {}, el('figcaption', {}, title), ...content.filter(Boolean)));
  const text = (x, y, words, anchor = 'middle') => svg('text', { x, y, 'text-anchor': anchor }, words);

  // Steps of 1, 2 or 5 times a power of ten, about four of them.
  function ticks(least, largest) {
    const raw = (largest - least) / 4 || 1;
    const power = 10 ** Math.floor(Math.log10(raw));
    const step = [1, 2, 5, 10].map((m) => m * power).find((s) => s >= raw);
    const out = [];
    for (let v = Math.ceil(least / step) * step; v <= largest + 1e-9 * step; v += step) out.push(+v.toPrecision(10));
    return out;
  }

  // series: [name, values, colour]; one vertical scale from 0 for all.
  function overTime(title, x, series, unit) {
    const lines = series.map(([name, y, colour]) => [name, x.map((v, i) => [v, y[i]]).filter((p) => p.every(Number.isFinite)), colour])
      .filter(([, good]) => good.length >= 2);
    if (!lines.length) return;
    let x0 = Infinity, x1 = -Infinity, y1 = 0;
    for (const [, good] of lines) for (const [a, b] of good) { x0 = Math.min(x0, a); x1 = Math.max(x1, a); y1 = Math.max(y1, b); }
    const most = y1;
    y1 = 1.05 * y1 || 1;
    const px = (v) => left + (v - x0) / (x1 - x0 || 1) * (wide - left - right);
    const py = (v) => high - bottom - v / y1 * (high - bottom - top);
    const root = svg('svg', { viewBox: `0 0 ${wide} ${high}`, role: 'img', 'aria-label': `${title}: at most ${number(most, unit)}` });
    for (const v of ticks(0, y1)) {
      root.append(svg('path', { class: 'axis', d: `M${left} ${py(v)}H${wide - right}` }), text(left - 6, py(v) + 4, String(v), 'end'));
    }
    for (const v of ticks(x0, x1)) root.append(text(px(v), high - bottom + 16, String(v)));
    for (const [, good, colour] of lines) {
      const thin = Math.max(1, Math.floor(good.length / 2000));
      root.append(svg('polyline', { fill: 'none', stroke: colour, 'stroke-width': 1.5,
        points: good.filter((_, i) => i % thin === 0).map((p) => `${px(p[0]).toFixed(1)},${py(p[1]).toFixed(1)}`).join(' ') }));
    }
    root.append(text(wide - right, high - 4, 'time (s)', 'end'), text(4, high - 4, unit, 'start'));
    figure(title, lines.length > 1 ? legend(lines.map(([name, , colour]) => [name, colour])) : null, root);
  }

  const legend = (entries) => el('div', { class: 'legend' }, ...entries.map(([label, colour]) =>
    el('span', {}, el('span', { class: 'swatch', style: `background:${colour}` }), label)));

  // rows: [name, [value, ...]]; one bar a value, all on one scale: logarithmic where they span more than 50.
  function bars(title, rows, series, show) {
    if (!rows.length) return;
    const all = rows.flatMap((r) => r[1]).filter((v) => Number.isFinite(v) && v > 0);
    const most = Math.max(...all, 1e-12), least = Math.min(...all, most);
    const powers = most / least > 50;
    const part = (v) => (!(v > 0) ? 0 : powers ? Math.log(v / least * 2) / Math.log(most / least * 2) : v / most);
    const each = 15, gap = 8, name = wide < 500 ? 110 : 140, value = wide < 500 ? 75 : 90;
    const rowHigh = each * series.length + gap;
    const root = svg('svg', { viewBox: `0 0 ${wide} ${rows.length * rowHigh}`, role: 'img', 'aria-label': title });
    rows.forEach(([label, values], r) => {
      root.append(text(name - 6, r * rowHigh + each * series.length / 2 + 4, label, 'end'));
      values.forEach((v, k) => {
        const length = Number.isFinite(v) ? Math.max(1, part(v) * (wide - name - value)) : 0;
        const y = r * rowHigh + k * each;
        root.append(svg('rect', { x: name, y, width: length, height: each - 2, fill: series[k][1] }),
          text(name + length + 5, y + each - 4, show(v), 'start'));
      });
    });
    figure(powers ? `${title} (bars on a logarithmic scale)` : title, series.length > 1 ? legend(series) : null, root);
  }

  // How far each pose moved from where it was before refinement, matched by time.
  function drift() {
    const { trajectory: after, before } = Lamina;
    if (!after || !before) return;
    const x = [], y = [];
    let k = 0;
    for (let i = 0; i < after.count; ++i) {
      while (k + 1 < before.count && before.times[k] < after.times[i] - 1e-4) ++k;
      if (!before.count || Math.abs(before.times[k] - after.times[i]) > 1e-3) continue;
      x.push(after.times[i]);
      y.push(Math.hypot(...[0, 1, 2].map((c) => after.positions[3 * i + c] - before.positions[3 * k + c])));
    }
    overTime('Drift corrected by refinement', x, [['moved by', y, '#d55e00']], 'm');
  }

  function windows() {
    const w = Lamina.data.window;
    if (!w) return;
    overTime('Size of the sliding window', w.times, [['keyframes', w.keyframes, '#0072b2']], 'keyframes');
    overTime('Residuals in the window', w.times, [['residuals', w.residuals, '#009e73']], 'rows');
    overTime('Time to solve the window', w.times, [['solve', w.solve_ms, '#e69f00']], 'ms');
  }

  Lamina.parts.push(() => {
    const { data } = Lamina;
    box.replaceChildren();
    wide = box.clientWidth && box.clientWidth < 520 ? 350 : 560;
    drift();
    const errors = data.evaluation && data.evaluation.trajectory;
    if (errors && errors.times && errors.errors_m) {
      overTime('Error of position against the reference', errors.times, [['error', errors.errors_m, '#0072b2']], 'm');
    }
    windows();
    const metrics = data.metrics || {};
    const ms = (v) => number(v, 'ms');
    bars('Time of each stage, one call', Object.entries(metrics.stages || {}).map(([name, s]) => [name, [s.median_ms, s.p95_ms]]),
      [['median', '#009e73'], ['95th percentile', '#e69f00']], ms);
    const refine = metrics.refine;
    if (refine && refine.cost_before) {
      const kinds = Object.keys({ ...refine.cost_before, ...refine.cost_after });
      bars('Squared residuals by kind of constraint', kinds.map((k) => [k.replace(/_/g, ' '), [refine.cost_before[k], (refine.cost_after || {})[k]]]),
        [['before refinement', '#8a8f94'], ['after', '#0072b2']], (v) => number(v));
    }
    bars('Skipped input', Object.entries(metrics.skipped || {}).map(([why, n]) => [why, [n]]), [['times', '#cc79a7']], String);
    if (!box.childElementCount) box.append(el('p', {}, 'No measurements were recorded with this map.'));
  });
})();
