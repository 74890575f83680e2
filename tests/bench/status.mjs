// How long a job's status takes with 1 000 connections open (500 event streams, 100 senders of a byte a
// second) and fits running, beside what a process that only echoes takes on the same machine.
//   figure NAME VALUE UNIT words
import { mkdtempSync, rmSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import { groomctl, startDaemon, until } from '../support/daemon.mjs';
import { underLoad } from '../support/load.mjs';

const afters = [], folder = mkdtempSync(join(tmpdir(), 'groomd-bench-'));
try {
  const daemon = await startDaemon({ after: (end) => afters.push(end), diagnostic: console.error }, { args: ['--workers', '2', '--log-level', 'warning'] });
  await groomctl(null, ['sample', '--style', 'curly', '--strands', '40000', '-o', folder]);
  let job;
  for (const seed of ['1', '2', '3', '4']) job = (await groomctl(daemon, ['--json', 'fit', join(folder, 'strands.hair'), '--head-file', join(folder, 'head.obj'), '--guides', '1500', '--seed', seed])).lines().at(-1).id;
  await until('two fits run', async () => (await daemon.json('/v1/jobs?state=running')).jobs.length === 2, 60000);
  const found = await underLoad(daemon, { streams: 500, slow: 100, idle: 400, seconds: 15, job });
  console.log(`figure status_p50_ms ${found.p50_ms.toFixed(3)} ms of ${found.n} answers, ${found.n_open} connections open`);
  console.log(`figure status_p99_ms ${found.p99_ms.toFixed(3)} ms`);
  console.log(`figure status_machine_p99_ms ${found.machine_p99_ms.toFixed(3)} ms a process that only echoes, with the same load`);
  console.log(`figure status_daemon_mb ${found.peak_mb.toFixed(1)} MB at most`);
} finally {
  for (const end of afters.reverse()) await end();
  rmSync(folder, { recursive: true, force: true });
}
