/* How many strands are drawn while the picture moves: as many as keep a steady frame; all of them at rest.
 * Frames are told apart by when they were asked for, which waits for the graphics card as for everything. */
const SLOW_MS = 40, QUICK_MS = 20, LEAST = 500, REST_MS = 180, PAUSE_MS = 400;

export class Detail {
    constructor(redraw) {
        Object.assign(this, { redraw, most: Infinity, moving: false, last: 0 });
    }

    /* Something moves: a drag of the camera, a knob. */
    move() {
        this.moving = true;
        clearTimeout(this.rest);
        this.rest = setTimeout(() => {
            this.moving = false;
            this.redraw();
        }, REST_MS);
    }

    /* Before each frame. returns how many of `count` strands to draw */
    frame(count, now) {
        const took = now - this.last;
        this.last = now;
        if (!this.moving) return count;
        if (took > SLOW_MS && took < PAUSE_MS * 10) this.most = Math.max(LEAST, Math.min(this.most, count) * Math.max(0.25, SLOW_MS / took * 0.8));
        else if (took < QUICK_MS) this.most = Math.min(count, this.most * 1.25);
        return Math.round(Math.min(count, this.most));
    }

    stop() { clearTimeout(this.rest); }
}
