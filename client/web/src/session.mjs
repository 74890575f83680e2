/* A groom that is open for work: the document, its revision, and the edits between them. A slider
 * moves the page at once; the edit then goes to the server as a PATCH with If-Match, and the server's
 * revision is the truth. Undo and redo walk along the revisions by reverting. */
import { call, get } from './api.mjs';

export class Session extends EventTarget {
    constructor(id, thread) {
        super();
        Object.assign(this, { id, thread, undone: [], sending: Promise.resolve(), busy: 0 }); /* busy: changes under way */
    }

    get at() { return `/v1/grooms/${this.id}`; }
    get operators() { return this.document.operators; }

    async open(count) {
        const { json, etag } = await call('GET', this.at);
        this.#take(json, etag);
        this.count = Math.min(count, json.strands.count);
        this.opened = await this.thread.call('open', { document: json, count: this.count });
        return this.opened;
    }

    #take(document, etag) {
        Object.assign(this, { document, etag, revision: document.revision });
        this.shown ??= document.revision;
    }

    #tell(what) { this.dispatchEvent(new CustomEvent(what)); }

    /* While the knob turns: the page alone. */
    async turn(index, parameter, value) {
        this.operators[index][parameter] = value;
        await this.thread.call('set', { index, type: this.operators[index].type, parameter, value });
        this.#tell('strands');
    }

    /* The knob rests: a revision. Edits go out one after another, each on the revision of the one before. */
    settle(index, parameter) {
        return this.patch([{ op: 'replace', path: `/operators/${index}/${parameter}`, value: this.operators[index][parameter] }], { reload: false });
    }

    /* A guide under the hand, and at rest: all guides go to the server as a file. */
    async moveGuide(guide, points) {
        await this.thread.call('moveGuide', { guide, points });
        this.#tell('strands');
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
        await this.thread.call('open', { document: json, count: this.count });
        this.#tell('document');
        this.#tell('strands');
    }

    async choose(count) {
        this.count = count;
        await this.thread.call('choose', { count });
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
