// A worker as a cluster runs it (--watched): how it died reaches the job, though no launcher saw it; and
// a run that a cluster started again does the job.
import assert from 'node:assert/strict';
import { chmodSync, readFileSync, writeFileSync } from 'node:fs';
import { join } from 'node:path';
import { test } from 'node:test';

import { build, groomctl, slowness, startDaemon, temporaryFolder, until } from '../support/daemon.mjs';

const options = { timeout: 120000 * slowness };

async function startJob(t, script, strands, args = []) {
  const folder = temporaryFolder(t), program = join(folder, 'worker');
  writeFileSync(program, `#!/bin/sh\nW='${join(build, 'groom-worker')}'\n[ "$1" = attempt ] || exec "$W" "$@"\n${script}\n`);
  chmodSync(program, 0o755);
  const daemon = await startDaemon(t, { args: ['--worker', program, ...args] });
  assert.equal((await groomctl(null, ['sample', '--style', 'curly', '--strands', String(strands), '-o', folder])).status, 0);
  const fit = await groomctl(daemon, ['--json', 'fit', join(folder, 'strands.hair'), '--guides', slowness > 1 ? '600' : '1500']);
  assert.equal(fit.status, 0, fit.stderr);
  return { daemon, job: fit.lines().at(-1).id };
}

const children = (pid) => readFileSync(`/proc/${pid}/task/${pid}/children`, 'utf8').split(' ').filter(Boolean).map(Number);

test('the words of a worker that is killed come from the process beside it', options, async (t) => {
  const { daemon, job } = await startJob(t, 'exec "$W" attempt --watched', slowness > 1 ? 6000 : 40000, ['--job-attempts', '1']);
  const pid = await until('both processes run', async () => (await daemon.json(`/v1/jobs/${job}`)).stage && daemon.workers().flatMap(children)[0], 60000);
  process.kill(pid, 'SIGKILL');
  const state = await until('the job has failed', async () => {
    const now = await daemon.json(`/v1/jobs/${job}`);
    return now.state === 'failed' && now;
  });
  assert.equal(state.error.type, '/problems/worker-died');
  assert.match(state.error.attempts[0].last_words, /^signal 9 \(Killed\)/);
});

test('a run that was started again does the job', options, async (t) => {
  const { daemon, job } = await startJob(t, 'GROOM_WORK_RUN=2 exec "$W" attempt --watched', 500);
  const state = await daemon.json(`/v1/jobs/${job}`, { headers: { Prefer: 'wait=60' } });
  assert.equal(state.state, 'succeeded', JSON.stringify(state.error));
});
