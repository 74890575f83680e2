// Real captures carried to scaled and reshaped copies of their own bodies: a picture before and one after from the
// same camera, and the report, into build/real-retargets. `make real-retargets`; tells what it skips.
import test from 'node:test';
import assert from 'node:assert/strict';
import { mkdirSync, readFileSync, writeFileSync } from 'node:fs';
import { dirname, join, resolve } from 'node:path';
import { fileURLToPath } from 'node:url';
import { groomctl, sharedData, startDaemon } from '../support/daemon.mjs';

const top = resolve(dirname(fileURLToPath(import.meta.url)), '../..'), out = join(top, process.env.BUILD ?? 'build', 'real-retargets');
const minutes = 60000;

/** Wider, a little taller, and the head larger than the rest: height is axis `up` of the file. */
function reshaped(path, up) {
  const lines = readFileSync(path, 'latin1').split('\n');
  const points = lines.map((line) => (line.startsWith('v ') ? line.split(/\s+/).slice(1, 4).map(Number) : null));
  const heights = points.filter(Boolean).map((p) => p[up]), low = Math.min(...heights), high = Math.max(...heights);
  return lines.map((line, i) => {
    const p = points[i];
    if (!p) return line;
    const head = 1 + 0.12 * Math.max(0, ((p[up] - low) / (high - low) - 0.8) / 0.2);
    return `v ${p.map((x, k) => x * (k === up ? 1.03 : 1.06 * head)).join(' ')}`;
  }).join('\n');
}

for (const { name, unit, up } of [{ name: 'harolongo', unit: 'cm', up: 'y' }, { name: 'combover', unit: 'm', up: 'z' }]) {
  const hair = sharedData(`${name}/hair.data`), body = sharedData(`${name}/body.obj`);
  test(`${name} goes to a reshaped copy of its body`, { skip: hair && body ? false : `SKIPPED: no ../shared/data/${name}` }, async (t) => {
    const daemon = await startDaemon(t);
    mkdirSync(out, { recursive: true });
    const say = async (args) => {
      const done = await groomctl(daemon, args, { timeout_ms: 5 * minutes });
      assert.equal(done.status, 0, done.stderr);
      return done.stdout;
    };
    const frame = ['--unit', unit, '--up', up], other = join(daemon.folder, `${name} reshaped.obj`);
    writeFileSync(other, reshaped(body, up === 'y' ? 1 : 2));
    const strands = JSON.parse((await say(['--json', 'upload', hair, ...frame])).trim().split('\n').pop());
    const head = JSON.parse((await say(['--json', 'upload-head', body, ...frame])).trim().split('\n').pop());
    const id = join(daemon.folder, 'id');
    await say(['retarget', strands.id, other, '--source', head.id, ...frame, '--groom-id-file', id]);
    const groom = readFileSync(id, 'utf8').trim();
    const { retarget } = JSON.parse(await say(['--json', 'get', groom]));
    writeFileSync(join(out, `${name}.json`), JSON.stringify(retarget, null, 1));

    // as it was, on its own body: a layer that changes nothing makes a groom of the upload
    const job = await (await daemon.fetch(`/v1/strands/${strands.id}/curl-scale`, { method: 'POST', body: JSON.stringify({ radius: 1, step: 1, enabled: false, head: head.id }), headers: { 'Content-Type': 'application/json' } })).json();
    const ended = await (await daemon.fetch(`/v1/jobs/${job.id}`, { headers: { Prefer: 'wait=300' } })).json();
    const middle = [0, 1, 2].map((k) => (strands.bbox.min[k] + strands.bbox.max[k]) / 2);
    const eye = [middle[0] + 0.55, middle[1] + 0.1, middle[2] + 0.95];
    for (const [when, which] of [['before', ended.result.groom], ['after', groom]])
      await say(['preview', which, '--eye', eye.join(','), '--target', middle.join(','), '--fov', '24', '--size', '640', '-o', join(out, `${name}-${when}.png`)]);
    const { before, after } = retarget.report.inside;
    t.diagnostic(`${before.vertices} vertices inside, then ${after.vertices}; energy ${retarget.report.energy.before.total.toFixed(1)}, then ${retarget.report.energy.after.total.toFixed(1)}`);
    assert.equal(after.vertices + after.segments, 0);
  });
}
