// Cancel really stops the work, and Ctrl-C leaves it alone.
import assert from 'node:assert/strict';
import { join } from 'node:path';
import { test } from 'node:test';

import { groomctl, slowness, startDaemon, temporaryFolder, until } from '../support/daemon.mjs';

const options = { timeout: 120000 * slowness };

async function startJob(t) {
  const daemon = await startDaemon(t), folder = temporaryFolder(t);
  const made = await groomctl(null, ['sample', '--style', 'curly', '--strands', slowness > 1 ? '6000' : '40000', '-o', folder]);
  assert.equal(made.status, 0, made.stderr);
  const fit = await groomctl(daemon, ['--json', 'fit', join(folder, 'strands.hair'), '--head-file', join(folder, 'head.obj'), '--guides', slowness > 1 ? '600' : '1500']);
  assert.equal(fit.status, 0, fit.stderr);
  const job = fit.lines().at(-1).id;
  await until('the job runs', async () => (await daemon.json(`/v1/jobs/${job}`)).state === 'running' && daemon.workers().length === 1, 60000);
  return { daemon, job };
}

test('cancel ends a running job and its worker within 2 s', options, async (t) => {
  const { daemon, job } = await startJob(t);
  const from = Date.now(), cancel = await groomctl(daemon, ['cancel', job]);
  assert.equal(cancel.status, 0, cancel.stderr);
  assert.match(cancel.stdout, /cancelled/);
  await until('no worker is left', () => daemon.workers().length === 0, 2500);
  const ms = Date.now() - from;
  t.diagnostic(`${ms} ms`);
  assert.ok(ms < 2500 * slowness, `${ms} ms`);
  assert.equal((await daemon.json(`/v1/jobs/${job}`)).state, 'cancelled');
  const watch = await groomctl(daemon, ['watch', job]);
  assert.equal(watch.status, 1);
  assert.match(watch.stderr, /was cancelled/);
});

test('Ctrl-C ends watching, says how to go on, and leaves the job alone', options, async (t) => {
  const { daemon, job } = await startJob(t);
  const heard = (child) => child.stdout.once('data', () => child.kill('SIGINT')); // it is watching by now
  const watch = await groomctl(daemon, ['watch', job], { on_start: heard });
  assert.equal(watch.status, 130, watch.stderr + watch.stdout);
  assert.match(watch.stderr, new RegExp(`${job} goes on.*groomctl watch ${job}.*groomctl cancel ${job}`));
  assert.equal((await daemon.json(`/v1/jobs/${job}`)).state, 'running');
  assert.equal((await groomctl(daemon, ['cancel', job])).status, 0);
});
