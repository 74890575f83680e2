// What a job may use: processor time, time by the clock, memory. Over one of them it fails at once and says which
// it was; the next job has its place.
import assert from 'node:assert/strict';
import { mkdtempSync, rmSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import { after, before, test } from 'node:test';

import { groomctl, slowness, startDaemon, until } from '../support/daemon.mjs';

const options = { timeout: 120000 * slowness };
let folder;

before(async () => {
  folder = mkdtempSync(join(tmpdir(), 'groomd-sample-'));
  for (const [name, n] of [['large', slowness > 1 ? '4000' : '40000'], ['small', '300']]) {
    const made = await groomctl(null, ['sample', '--style', 'curly', '--strands', n, '-o', join(folder, name)]);
    assert.equal(made.status, 0, made.stderr);
  }
});
after(() => rmSync(folder, { recursive: true, force: true }));

/** The job as it ended. */
async function fit(daemon, name, more) {
  const made = await groomctl(daemon, ['--json', 'fit', join(folder, name, 'strands.hair'), ...more]);
  assert.equal(made.status, 0, made.stderr);
  const { id } = made.lines().at(-1);
  return until(`${id} ends`, async () => {
    const job = await daemon.json(`/v1/jobs/${id}`);
    return ['succeeded', 'failed', 'cancelled'].includes(job.state) && job;
  }, 60000);
}

const large = ['large', ['--guides', '1500']], small = ['small', ['--guides', '20', '--quality', 'draft']];

test('processor time', options, async (t) => {
  const daemon = await startDaemon(t, { args: ['--job-time', '2'] });
  const job = await fit(daemon, ...large);
  assert.equal(job.state, 'failed');
  assert.equal(job.error.type, '/problems/time-limit');
  assert.match(job.error.detail, /2 s of processor time \(--job-time\)/);
  assert.deepEqual(job.error.attempts.map(({ last_words }) => last_words), ['signal 24 (CPU time limit exceeded)']);
});

test('time by the clock', options, async (t) => {
  const daemon = await startDaemon(t, { args: ['--job-wall', '2'] });
  const job = await fit(daemon, ...large);
  assert.equal(job.error?.type, '/problems/time-limit', job.state);
  assert.match(job.error.detail, /2 s of time \(--job-wall\)/);
  assert.equal(job.error.attempts.length, 1);
  assert.match(job.error.attempts[0].last_words, /^exit status 75\n.*asked to, by a signal/);
});

test('memory', { ...options, skip: slowness > 1 && 'a sanitizer reserves all the address space there is' }, async (t) => {
  // Much below what it needs, and such that matrix products find no room (where OpenBLAS looks for it for ever).
  for (const memory of ['200M', '300M', '420M']) {
    const daemon = await startDaemon(t, { args: ['--worker-memory', memory, '--worker-threads', '2'] });
    const job = await fit(daemon, ...large);
    assert.equal(job.error?.type, '/problems/out-of-memory', `${memory}: ${JSON.stringify(job)}`);
    assert.match(job.error.detail, /memory/);
    assert.equal(job.attempt, 1, 'another attempt would want as much');
  }
  const daemon = await startDaemon(t, { args: ['--worker-memory', '600M', '--worker-threads', '1'] });
  assert.equal((await fit(daemon, ...small)).state, 'succeeded');
});
