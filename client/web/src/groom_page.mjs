/* One groom: the picture on the left, the work on the right. */
import { EngineThread } from './engine_thread.mjs';
import { by_id, element, notice, say, whole } from './dom.mjs';
import { GuideEditor } from './guide_editor.mjs';
import { Session } from './session.mjs';
import { fetchHead } from './strands.mjs';
import { exportPanel } from './panels/export.mjs';
import { picturePanel } from './panels/picture.mjs';
import { historyPanel } from './panels/history.mjs';
import { operatorsPanel } from './panels/operators.mjs';
import { retargetPanel } from './panels/retarget.mjs';
import { sculptPanel } from './panels/sculpt.mjs';
import { viewPanel } from './panels/view.mjs';
import { Hair, boxOf } from './viewer/hair.mjs';
import { Viewer } from './viewer/viewer.mjs';

const AT_FIRST = 10000, LIGHT_CELLS = 64, LIGHT_AFTER_MS = 250, ALL_AFTER_MS = 120, MOVING_MS = 30;

/* Strands come as fast as the engine makes them; what piles up while one evaluation runs is one request. While
 * a knob turns, as many as keep up with the hand; all of them when it rests. */
class Evaluation extends EventTarget {
    constructor(session, viewer) {
        super();
        Object.assign(this, { session, viewer, running: false, again: false });
        session.addEventListener('strands', ({ detail }) => this.request(detail?.moving).catch(notice));
        session.addEventListener('attempt', () => this.#attempt());
    }

    /* Strands of an attempt in place of their own, until the next evaluation. */
    #attempt() {
        const { vertices } = this.strands;
        for (const { slot, points } of this.session.attempt) this.strands.points.set(points, 3 + 3 * slot * vertices);
        this.viewer.show(this.viewer.groom, this.strands);
    }

    #most() {
        const { evaluated, ms } = this.strands ?? {};
        return this.moving && ms > MOVING_MS ? (evaluated * MOVING_MS) / ms : Infinity;
    }

    async request(moving = false) {
        this.moving = moving;
        if (moving) this.viewer.detail.move();
        if (this.running) { this.again = true; return; }
        this.running = true;
        try {
            do {
                this.again = false;
                const { strands: shown, spare } = this;
                this.spare = undefined;
                this.strands = await this.session.strands(this.#most(), spare);
                this.spare = shown?.points;
                this.viewer.show(this.viewer.groom, this.strands);
                this.dispatchEvent(new Event('shown'));
                say(`${whole(this.strands.count)} of ${whole(this.session.document.strands.count)} strands, ${this.strands.ms.toFixed(0)} ms`);
            } while (this.again);
        } finally { this.running = false; }
        clearTimeout(this.soon);
        if (this.strands.evaluated < this.strands.count) this.soon = setTimeout(() => this.request().catch(notice), ALL_AFTER_MS);
        else this.soon = setTimeout(() => this.light().catch(notice), this.lit ? LIGHT_AFTER_MS : 0);
    }

    async light() {
        await shine(this.viewer, this.viewer.groom, this.session.thread, this.session.remote ? this.strands : undefined);
        this.lit = true;
    }
}

/* Shadows: of the strands given, or of those that the engine has. */
async function shine(viewer, hair, thread, strands) {
    const width = Hair.widthOf(viewer.diagonal, hair.count);
    hair.shine(await thread.call('light', { strands, cells: LIGHT_CELLS, width, key: Viewer.KEY.toArray() }));
    viewer.draw();
}

/* strands: how many to show at first (#/grooms/ID?strands=N) */
export async function groomPage(main, id, strands = AT_FIRST) {
    const thread = new EngineThread(), session = new Session(id, thread);
    say('Opening …');
    const { types } = await session.open(Number(strands));
    const picture = element('div', { class: 'picture' }), work = element('aside', { class: 'work', 'aria-label': 'Work' });
    main.replaceChildren(element('div', { class: 'studio' }, picture, work));
    by_id('trail').replaceChildren(element('a', { href: `#/grooms/${id}` }, session.document.name || id));
    const viewer = new Viewer(picture), evaluation = new Evaluation(session, viewer);
    const editor = new GuideEditor(viewer, session), chain = element('div', { class: 'chain' });
    const view = viewPanel(work, { session, viewer, evaluation, editor, shine: (hair, own) => shine(viewer, hair, thread, own) });
    work.append(chain);
    operatorsPanel(chain, session, types);
    const armature = sculptPanel(work, session, viewer);
    historyPanel(work, session);
    retargetPanel(work, session);
    exportPanel(work, session);
    picturePanel(work, session, viewer);
    await evaluation.request();
    viewer.frame(boxOf(evaluation.strands));
    viewer.look('front');
    const { head } = session.document.source ?? {};
    if (head) fetchHead(head).then((geometry) => viewer.setHead(geometry)).catch(notice);
    view.reload().catch(notice);
    window.studio = { viewer, session, evaluation, editor, armature, view }; /* for those who look inside, tests among them */
    return () => { viewer.dispose(); thread.close(); };
}
