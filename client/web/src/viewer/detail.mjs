/* How many strands are drawn: while something moves as many as keep a steady frame, at rest all of them, and
 * where these take long, not before the hand has rested for a while. What the graphics card is still busy with is
 * waited for, so that no frames pile up; how long it took says how much it can take. */
const MOVING_MS = 25, RESTING_MS = 150, IDLE_MS = 500, POLL_MS = 4;
const FIRST = 40000; /* segments, of a card that is not known yet */
const LEAST = 10000; /* fewer are no picture */

export class Detail {
    /* redraw: asked for when there is more to draw, or the card is free again */
    constructor(gl, redraw) {
        Object.assign(this, { gl, redraw, per_ms: FIRST / MOVING_MS, moved: performance.now(), busy: false, whole: false, again: false });
    }

    /* Something moves: a drag of the camera, a knob. */
    move() { this.moved = performance.now(); }

    /* How many of `segments` to draw now. */
    take(segments) {
        const still = performance.now() - this.moved, patient = still > IDLE_MS;
        const most = patient ? Infinity : still > MOVING_MS * 6 && segments / this.per_ms < RESTING_MS ? Infinity : this.per_ms * MOVING_MS;
        const taken = Math.min(segments, Math.max(LEAST, this.measured ? most : FIRST));
        this.whole = taken >= segments;
        if (this.measured && !this.whole) this.#later(still);
        return taken;
    }

    #later(still) {
        clearTimeout(this.rest);
        this.rest = setTimeout(this.redraw, Math.max(20, (still < MOVING_MS * 6 ? MOVING_MS * 6 : IDLE_MS) - still + 5));
    }

    /* A frame of so many segments was handed to the card. */
    submitted(segments) {
        const { gl } = this, from = performance.now(), fence = gl.fenceSync(gl.SYNC_GPU_COMMANDS_COMPLETE, 0);
        gl.flush();
        this.busy = true;
        const poll = () => {
            const state = gl.clientWaitSync(fence, 0, 0);
            if (state === gl.TIMEOUT_EXPIRED) { this.poll = setTimeout(poll, POLL_MS); return; }
            gl.deleteSync(fence);
            this.#done(segments, performance.now() - from);
        };
        this.poll = setTimeout(poll, 0);
    }

    #done(segments, took) {
        const measured = segments / Math.max(took, 1), first = !this.measured;
        if (segments >= LEAST) {
            this.per_ms = first ? measured : 0.5 * (this.per_ms + measured);
            this.measured = true;
        }
        this.busy = false;
        if (this.again || (first && !this.whole)) {
            this.again = false;
            this.redraw();
        }
    }

    stop() {
        clearTimeout(this.rest);
        clearTimeout(this.poll);
    }
}
