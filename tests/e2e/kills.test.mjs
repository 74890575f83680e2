// SIGKILL, at random moments, of the daemon and of its workers, over a workload of uploads, fits and
// edits: nothing that a client was told is lost, and no job comes to two results.
//   KILLS (15; 1000 in make test-service), KILLS_SEED
import assert from 'node:assert/strict';
import { join } from 'node:path';
import { test } from 'node:test';
import { setTimeout as sleep } from 'node:timers/promises';

import { build, run, slowness, startDaemon, until } from '../support/daemon.mjs';
import { random, Workload } from '../support/kills.mjs';

const n_kills = Number(process.env.KILLS ?? 15), seed = Number(process.env.KILLS_SEED ?? 1);

/** A worker of now, or the daemon itself. */
async function killOne(daemon, next, counts) {
  const [worker] = next() < 0.4 ? daemon.workers() : [];
  if (worker) {
    try { process.kill(worker, 'SIGKILL'); counts.workers++; } catch { /* it has just ended */ }
    return;
  }
  await daemon.kill();
  counts.daemons++;
  if (next() < 0.2) { // and once more while it starts
    const starting = daemon.start().catch(() => null);
    await sleep(40 * next());
    daemon.child?.kill('SIGKILL');
    await starting;
    counts.daemons++;
    if (daemon.child.exitCode === null && daemon.child.signalCode === null) await daemon.kill();
  }
  await daemon.start();
}

test(`${n_kills} kills lose nothing`, { timeout: (300000 + n_kills * 4000) * slowness }, async (t) => {
  const daemon = await startDaemon(t, { args: ['--workers', '2', '--worker-threads', '1', '--job-attempts', '100', '--log-level', 'error'] });
  const workload = new Workload(daemon, seed), next = random(seed), counts = { daemons: 0, workers: 0 };
  workload.start(4, 3 + n_kills / 4);
  while (counts.daemons + counts.workers < n_kills) {
    // after a few answers, and then in the midst of something; now and then at once
    const wanted = workload.n_told + Math.floor(6 * next()), late = Date.now() + 4000;
    while (workload.n_told < wanted && Date.now() < late) await sleep(2);
    await sleep(60 * next());
    await killOne(daemon, next, counts);
  }
  await workload.stop();
  await workload.drain((240000 + n_kills * 1000) * slowness);
  const found = await workload.examine();
  t.diagnostic(`killed the daemon ${counts.daemons} times and workers ${counts.workers} times; ${JSON.stringify(found)}`);
  assert.ok(found.uploads > 0 && found.jobs > 0 && found.revisions > 0, JSON.stringify(found));
  await until('no worker is left', () => daemon.workers().length === 0);
  await daemon.stop();
  const check = await run(join(build, 'groomd'), ['check', '--data', daemon.data]);
  assert.equal(check.status, 0, check.stdout + check.stderr);
});
