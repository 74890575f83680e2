// SIGKILL in the middle of a job, of the worker and of the daemon: nothing is lost, and the job ends
// with the bits of one that nobody disturbed.
import assert from 'node:assert/strict';
import { existsSync, mkdtempSync, rmSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import { after, before, test } from 'node:test';

import { groomctl, slowness, startDaemon, until } from '../support/daemon.mjs';

const options = { timeout: 240000 * slowness };
// Large enough that every kill below finds the job in its middle.
const size = ['--strands', '6000'], guides = ['--guides', '600'];
let folder, undisturbed;

async function json(daemon, args) {
  const result = await groomctl(daemon, ['--json', ...args]);
  assert.equal(result.status, 0, `${args.join(' ')}\n${result.stderr}${result.stdout}`);
  return result.lines();
}

async function submit(daemon) {
  const [strands] = await json(daemon, ['upload', join(folder, 'strands.hair')]);
  const [head] = await json(daemon, ['upload-head', join(folder, 'head.obj')]);
  return (await json(daemon, ['fit', strands.id, '--head', head.id, ...guides]))[0].id;
}

/** Until a part of the job is done and kept, and a part is left. */
function midway(daemon, job) {
  return until('the job is in its middle', async () => {
    const state = await daemon.json(`/v1/jobs/${job}`);
    assert.ok(['queued', 'running'].includes(state.state), `the job is too short for this test: ${state.state}`);
    return state.progress > 0.05 && /"path":"\/v1\/work\/checkpoint","status":204/.test(daemon.log());
  }, 60000);
}

/** How far the job was when its nth attempt first spoke of it: more than nothing where it went on from a checkpoint. */
async function progressAtStartOf(daemon, job, attempt) {
  let present = 0;
  for (const [, name, text] of (await (await daemon.fetch(`/v1/jobs/${job}/events`)).text()).matchAll(/event: (\w+)\ndata: (.*)\n/g)) {
    const data = JSON.parse(text);
    if (name === 'state' && data.state === 'running') present = data.attempt;
    if (name === 'progress' && present === attempt) return data.progress;
  }
  return null;
}

async function ended(daemon, job) {
  return until('the job ends', async () => {
    const state = await daemon.json(`/v1/jobs/${job}`);
    return ['succeeded', 'failed', 'cancelled'].includes(state.state) && state;
  }, 180000);
}

async function strandsOf(daemon, state) {
  assert.equal(state.state, 'succeeded', JSON.stringify(state.error));
  const response = await daemon.fetch(`/v1/grooms/${state.result.groom}/strands?format=hair`);
  assert.equal(response.status, 200);
  return Buffer.from(await response.arrayBuffer());
}

/** The strands of a job that was disturbed are those of one that was not; where they are not, how far they are is half of why. */
function sameBits(strands) {
  let first = -1, n = 0;
  for (let i = 0; i < undisturbed.length; i++)
    if (strands[i] !== undisturbed[i]) { n++; if (first < 0) first = i; }
  assert.ok(strands.equals(undisturbed), `the same bits: ${n} of ${undisturbed.length} bytes differ, from ${first} on`);
}

before(async () => {
  folder = mkdtempSync(join(tmpdir(), 'groomd-sample-'));
  const made = await groomctl(null, ['sample', '--style', 'curly', ...size, '--seed', '9', '-o', folder]);
  assert.equal(made.status, 0, made.stderr);
});
after(() => rmSync(folder, { recursive: true, force: true }));

test('a job that nobody disturbs', options, async (t) => {
  const daemon = await startDaemon(t), state = await ended(daemon, await submit(daemon));
  undisturbed = await strandsOf(daemon, state);
  assert.equal(state.attempt, 1);
});

test('a killed worker: a new attempt goes on and ends with the same bits', options, async (t) => {
  const daemon = await startDaemon(t), job = await submit(daemon);
  await midway(daemon, job);
  const [pid] = daemon.workers();
  assert.ok(pid, 'a worker runs');
  process.kill(pid, 'SIGKILL');
  const state = await ended(daemon, job);
  sameBits(await strandsOf(daemon, state));
  assert.equal(state.attempt, 2);
  assert.ok(await progressAtStartOf(daemon, job, 2) > await progressAtStartOf(daemon, job, 1), 'it went on from the checkpoint');
});

test('a worker that somebody else asks to end: it keeps what it has done, and the next one goes on', options, async (t) => {
  const daemon = await startDaemon(t), job = await submit(daemon);
  await midway(daemon, job);
  const [pid] = daemon.workers(), reached = (await daemon.json(`/v1/jobs/${job}`)).progress;
  process.kill(pid, 'SIGTERM');
  const state = await ended(daemon, job);
  sameBits(await strandsOf(daemon, state));
  assert.equal(state.attempt, 2);
  assert.match(daemon.log(), /"state":"queued","attempt_state":"died","last_words":"exit status 75"/);
  assert.ok(await progressAtStartOf(daemon, job, 2) >= reached, 'nothing of it was done again');
});

test('a killed daemon: its worker goes with it, and the job ends with the same bits after the restart', options, async (t) => {
  const daemon = await startDaemon(t), job = await submit(daemon);
  await midway(daemon, job);
  const [pid] = daemon.workers();
  await daemon.kill();
  await until('the worker is gone', () => !existsSync(`/proc/${pid}/exe`) || !existsSync(`/proc/${pid}`), 15000);
  await daemon.start();
  const state = await ended(daemon, job);
  sameBits(await strandsOf(daemon, state));
  assert.ok(await progressAtStartOf(daemon, job, state.attempt) > await progressAtStartOf(daemon, job, 1), 'it went on from the checkpoint');
});

test('a daemon that is asked to stop in the middle drains within 10 s, and the job goes on afterwards', options, async (t) => {
  const daemon = await startDaemon(t), job = await submit(daemon);
  await midway(daemon, job);
  const how = await daemon.stop();
  assert.equal(how.code, 0);
  assert.ok(how.ms < 10000 * slowness, `${how.ms} ms`);
  await daemon.start();
  sameBits(await strandsOf(daemon, await ended(daemon, job)));
});
