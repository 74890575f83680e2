/* A groom that is open for work: the document, its revision, and the edits between them. A slider
 * moves the page at once; the edit then goes to the server as a PATCH with If-Match, and the server's
 * revision is the truth. Undo and redo walk along the revisions by reverting. */
import { call, follow, get } from './api.mjs';
import { arrayOf, fetchGroomStrands } from './strands.mjs';

const LAYERS = ['ruffle', 'sculpt', 'interpolate', 'curl_scale'];
/* A layer is tried under the hand on so many strands at most (the daemon's limit). */
const MOST_TO_TRY = 5000;

export class Session extends EventTarget {
    constructor(id, thread) {
        super();
        Object.assign(this, { id, thread, undone: [], sending: Promise.resolve(), busy: 0 }); /* busy: changes under way */
    }

    get at() { return `/v1/grooms/${this.id}`; }
    get operators() { return this.document.operators; }

    /* Layers, and grooms on strands of an upload, are the daemon's to evaluate: they look at all strands. */
    get remote() {
        return Boolean(this.document.base) || this.operators.some((o) => LAYERS.includes(o.type) && o.enabled !== false);
    }

    async open(count) {
        const { json, etag } = await call('GET', this.at);
        this.#take(json, etag);
        this.count = Math.min(count, json.strands.count);
        await this.#load();
        return this.thread.call('about');
    }

    async #load() {
        if (!this.remote) await this.thread.call('open', { document: this.document, count: this.count });
        await this.#arrange();
    }

    /* Strands are shown in a fair order: `order` says which strand stands in a slot, `slotOf` in which slot the
     * i-th of them in rising order stands, as the daemon sends them. */
    async #arrange() {
        const n = this.document.strands.count;
        if (this.order?.length === this.count && this.arranged === n) return;
        this.order = await this.thread.call('fair', { n, count: this.count });
        this.arranged = n;
        this.slots = new Map(Array.from(this.order, (strand, slot) => [strand, slot]));
        this.slotOf = Uint32Array.from(this.order.slice().sort(), (strand) => this.slots.get(strand));
    }

    /* What is to be seen: { points, count, vertices, evaluated, ms }; of the engine's, the first `most` alone.
     * spare: points of an earlier answer that nobody looks at any more. */
    async strands(most, spare) {
        if (!this.remote) return this.thread.call('evaluate', { most, spare }, spare ? [spare.buffer] : []);
        const from = performance.now(), strands = await fetchGroomStrands(this.at, this.revision, this.count, this.slotOf);
        return { ...strands, evaluated: strands.count, ms: performance.now() - from };
    }

    /* The same of another revision, as the daemon has it. */
    strandsOf(revision) { return fetchGroomStrands(this.at, revision, this.count, this.slotOf); }

    /* --- layers under the hand --- */

    /* An attempt's strands in place of those that are shown: `points` as the daemon answers. */
    async tryOn(points) {
        const vertices = this.document.strands.vertices, made = arrayOf(points.points);
        this.attempt = arrayOf(points.strand).reduce((found, strand, i) => {
            if (this.slots.has(strand)) found.push({ slot: this.slots.get(strand), points: made.subarray(3 * i * vertices, 3 * (i + 1) * vertices) });
            return found;
        }, []);
        this.#tell('attempt');
    }

    /* A layer's knob while it turns: tried where it is the last of the chain and the daemon answers at once. */
    async #tryLayer(index) {
        const operator = this.operators[index];
        if (index !== this.operators.length - 1 || this.document.strands.count > MOST_TO_TRY || this.trying) return;
        this.trying = true;
        try {
            const { random, type, id, enabled, ...given } = operator;
            const { json } = await call('POST', `${this.at}/${type.replace('_', '-')}`, { body: { ...given, layer: id, commit: false }, headers: { 'If-Match': this.etag } });
            if (json.points) await this.tryOn(json.points);
        } finally { this.trying = false; }
    }

    /* A layer of this kind onto the chain, or its change; a long one is a job that is waited for. */
    layer(kind, body) {
        let answer;
        return this.#queue(async () => {
            const { json, etag, response } = await call('POST', `${this.at}/${kind}`, { body, headers: { 'If-Match': this.etag } });
            if (response.status === 202) await new Promise((resolve, reject) => follow(json.id, (name, data) => {
                if (name !== 'state') return;
                if (data.state === 'succeeded') resolve();
                else if (['failed', 'cancelled'].includes(data.state)) reject(new Error(`the job ${json.id} ${data.state}`));
            }));
            answer = json;
            return { json, etag };
        }, true).then(() => answer);
    }

    #take(document, etag) {
        Object.assign(this, { document, etag, revision: document.revision });
        this.shown ??= document.revision;
    }

    #tell(what, detail) { this.dispatchEvent(new CustomEvent(what, { detail })); }

    /* Another revision stands beside this one in the picture; null: the target again. */
    compareWith(revision) { this.#tell('against', { revision }); }

    /* An operator as the fit, or whoever made the groom, left it; undefined where it came later. */
    async original(id) {
        this.first ??= get(`${this.at}?revision=1&arrays=false`);
        return (await this.first).operators.find((operator) => operator.id === id);
    }

    /* While the knob turns: the page alone. */
    async turn(index, parameter, value) {
        this.operators[index][parameter] = value;
        if (LAYERS.includes(this.operators[index].type)) return this.#tryLayer(index);
        if (this.remote) return undefined; /* seen when the knob rests */
        await this.thread.call('set', { index, type: this.operators[index].type, parameter, value });
        return this.#tell('strands', { moving: true });
    }

    /* The knob rests: a revision. Edits go out one after another, each on the revision of the one before. */
    settle(index, parameter) {
        return this.patch([{ op: 'add', path: `/operators/${index}/${parameter}`, value: this.operators[index][parameter] }], { reload: this.remote });
    }

    /* A guide under the hand, and at rest: all guides go to the server as a file. */
    async moveGuide(guide, points) {
        if (this.remote) return undefined;
        await this.thread.call('moveGuide', { guide, points });
        return this.#tell('strands', { moving: true });
    }

    putGuides(file) {
        return this.#queue(() => call('PUT', `${this.at}/guides?format=data`,
            { body: new Blob([file]), type: 'application/octet-stream', headers: { 'If-Match': this.etag } }), true);
    }

    patch(operations, { reload = true } = {}) {
        return this.#queue(() => call('PATCH', this.at,
            { body: operations, type: 'application/json-patch+json', headers: { 'If-Match': this.etag } }), reload);
    }

    #queue(send, reload) {
        this.sending = this.sending.catch(() => {}).then(() => this.#commit(send, reload));
        return this.sending;
    }

    async #commit(send, reload) {
        this.busy++;
        try {
            const { json, etag } = await send();
            Object.assign(this, { etag, revision: json.revision, shown: json.revision, undone: [] });
            if (reload) await this.reload();
        } catch (error) {
            await this.reload(); /* what the server holds is what is shown */
            throw error;
        } finally {
            this.busy--;
            this.#tell('revision');
        }
    }

    async reload() {
        const { json, etag } = await call('GET', this.at);
        this.#take(json, etag);
        await this.#load();
        this.#tell('document');
        this.#tell('strands');
    }

    async choose(count) {
        this.count = count;
        if (!this.remote) await this.thread.call('choose', { count });
        await this.#arrange();
        this.#tell('chosen');
        this.#tell('strands');
    }

    /* --- history: nothing is overwritten, an undo is a new revision that holds the old --- */

    async revisions() { return (await get(`${this.at}/revisions`)).revisions; }

    revert(revision) {
        return this.#queue(() => call('POST', `${this.at}/revert`, { body: { revision }, headers: { 'If-Match': this.etag } }), true);
    }

    /* The revision whose content is shown stands in `shown`; a revert's own number does not count. */
    async undo() {
        const now = this.shown;
        if (now <= 1) return;
        this.undone.push(now);
        const undone = this.undone;
        await this.revert(now - 1);
        Object.assign(this, { shown: now - 1, undone });
        this.#tell('revision');
    }

    async redo() {
        const next = this.undone.at(-1);
        if (!next) return;
        const undone = this.undone.slice(0, -1);
        await this.revert(next);
        Object.assign(this, { shown: next, undone });
        this.#tell('revision');
    }
}
