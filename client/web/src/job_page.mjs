/* A job: its stages as they pass, time left, loss curves; and the groom when it is there. */
import uPlot from 'uplot';
import { call, follow, get } from './api.mjs';
import { action, by_id, element, notice, say } from './dom.mjs';

const LOOKS = ['#5fb4ff', '#ffb454', '#7fd962', '#d2a6ff', '#f07178', '#95e6cb'];

/* One plot a stage; each loss a line of its own. */
class Curves {
    constructor(parent) { Object.assign(this, { parent, stages: new Map() }); }

    add(stage, { iteration, name, value }) {
        if (!this.stages.has(stage)) this.stages.set(stage, { names: [], rows: new Map() });
        const curves = this.stages.get(stage);
        if (!curves.names.includes(name)) curves.names.push(name);
        if (!curves.rows.has(iteration)) curves.rows.set(iteration, {});
        curves.rows.get(iteration)[name] = value;
    }

    draw() {
        for (const [stage, curves] of this.stages) {
            const at = [...curves.rows.keys()].sort((a, b) => a - b);
            const data = [at, ...curves.names.map((name) => at.map((i) => curves.rows.get(i)[name] ?? null))];
            if (curves.plot?.series.length === data.length) { curves.plot.setData(data); continue; }
            curves.plot?.destroy();
            curves.box ??= this.parent.appendChild(element('figure', {}, element('figcaption', {}, stage.replaceAll('_', ' '))));
            curves.plot = new uPlot({
                width: 420, height: 200, scales: { x: { time: false } },
                axes: [{ stroke: '#ccc', grid: { stroke: '#fff2' } }, { stroke: '#ccc', grid: { stroke: '#fff2' }, size: 70 }],
                series: [{ label: 'iteration' }, ...curves.names.map((label, i) => ({ label, stroke: LOOKS[i % LOOKS.length], spanGaps: true, points: { size: 5 } }))],
            }, data, curves.box);
        }
    }
}

const minutes = (s) => (s >= 90 ? `${Math.round(s / 60)} min left` : `${Math.max(1, Math.round(s))} s left`);

export async function jobPage(main, id) {
    const job = await get(`/v1/jobs/${id}`);
    const bar = element('progress', { max: 1, value: job.progress, 'aria-label': 'Progress' }), words = element('p', { role: 'status' });
    const open = element('a', { class: 'button', hidden: true }, 'Open the groom');
    const again = element('a', { class: 'button', hidden: true, href: `#/retarget/${job.groom ?? job.strands}` }, 'Back to heads and hairline');
    const cancel = action('Cancel', () => call('DELETE', `/v1/jobs/${id}`)), plots = element('div', { class: 'plots' });
    main.replaceChildren(element('div', { class: 'job panel' }, element('h2', {}, `${job.kind} of ${job.strands ?? job.groom}`), bar, words, element('div', { class: 'row' }, cancel, open, again), plots));
    by_id('trail').replaceChildren(element('a', { href: `#/jobs/${id}` }, id));
    say('');
    const curves = new Curves(plots);
    for (const [stage, rows] of Object.entries(await get(`/v1/jobs/${id}/losses`))) rows.forEach((row) => curves.add(stage, row));
    curves.draw();
    const end = async () => {
        const last = await get(`/v1/jobs/${id}`);
        cancel.hidden = true;
        again.hidden = last.kind !== 'retarget' || last.state === 'succeeded';
        words.textContent = last.error ? `${last.state}: ${last.error.detail ?? last.error.title}` : last.state;
        bar.value = last.state === 'succeeded' ? 1 : last.progress;
        if (last.result?.groom) Object.assign(open, { href: `#/grooms/${last.result.groom}`, hidden: false });
        return last;
    };
    /* A retargeting takes moments: who waits for it wants to see it. */
    const leave = ({ kind, result }) => { if (kind === 'retarget' && result?.groom && location.hash === `#/jobs/${id}`) location.hash = open.hash; };
    if (['succeeded', 'failed', 'cancelled'].includes(job.state)) { await end(); return () => {}; }
    words.textContent = job.state;
    return follow(id, (name, data) => {
        if (name === 'progress') {
            bar.value = data.progress;
            words.textContent = `${data.stage.replaceAll('_', ' ')}${data.eta_s !== undefined ? `, ${minutes(data.eta_s)}` : ''}`;
        } else if (name === 'loss') {
            data.losses.forEach((row) => curves.add(row.stage ?? data.stage, row));
            curves.draw();
        } else if (name === 'state' && ['succeeded', 'failed', 'cancelled'].includes(data.state)) end().then(leave).catch(notice);
    });
}
