/* The page's end of worker.mjs: each call is a promise. */
export class EngineThread {
    constructor() {
        this.worker = new Worker('/studio/worker.js', { type: 'module' });
        this.waiting = new Map();
        this.next = 1;
        this.worker.onmessage = ({ data: { id, value, error } }) => {
            const { resolve, reject } = this.waiting.get(id);
            this.waiting.delete(id);
            if (error) reject(Object.assign(new Error(error.message), error));
            else resolve(value);
        };
    }

    call(name, given = {}, handed = []) {
        const id = this.next++;
        return new Promise((resolve, reject) => {
            this.waiting.set(id, { resolve, reject });
            this.worker.postMessage({ id, name, ...given }, handed);
        });
    }

    close() { this.worker.terminate(); }
}
