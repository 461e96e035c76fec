// A map under way: asks the server for what is new, once a second, and draws it.
'use strict';
(() => {
  const { el, duration } = Lamina;
  if (!Lamina.data.live) return;
  document.head.append(el('link', { rel: 'icon', href: 'data:,' }));  // else the browser asks for one
  const line = document.getElementById('live');
  let version = 0, lost = 0;

  function say() {
    const live = Lamina.data.live;
    const share = live.total > 0 ? ` ${live.done} of ${live.total} measurements` : live.done ? ` ${live.done} measurements` : '';
    const words = { waiting: 'Waiting for the first data', reading: 'Reading:', mapping: 'Mapping:', refining: 'Refining the whole map',
      finished: `Finished after ${duration(live.seconds)}; this stays in ${live.folder}/report.html` };
    const gone = lost > 3 && live.doing !== 'finished';
    line.hidden = false;
    line.dataset.doing = gone ? 'gone' : live.doing;
    line.dataset.version = version;
    line.replaceChildren(el('span', { class: 'dot', 'aria-hidden': true }),
      gone ? 'The run does not answer any more; this is the last that it said.' : words[live.doing] + (live.doing === 'finished' ? '' : share));
    if (live.total > 0 && live.doing !== 'finished') line.append(el('progress', { max: live.total, value: live.done, 'aria-label': 'measurements read' }));
  }

  async function ask() {
    try {
      const answer = await fetch(`data?after=${version}`, { cache: 'no-store' });
      if (answer.status === 200) {
        const data = await answer.json();
        version = Number(answer.headers.get('X-Version'));
        Lamina.load(data);
        Lamina.refresh();
      }
      lost = 0;
    } catch (problem) {
      ++lost;
    }
    say();
    if (Lamina.data.live.doing !== 'finished') setTimeout(ask, lost > 3 ? 5000 : 1000);
  }
  say();
  ask();
})();
