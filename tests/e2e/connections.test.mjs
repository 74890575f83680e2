// Event streams, slow senders and idle connections by the hundred, with fits running: a job's status is
// answered all the while. Times are printed, not judged.
//   CONNECTIONS (60; 1000 in make test-service), half of them event streams, a tenth slow senders
import assert from 'node:assert/strict';
import { cpus, loadavg } from 'node:os';
import { join } from 'node:path';
import { test } from 'node:test';

import { groomctl, slowness, startDaemon, temporaryFolder, until } from '../support/daemon.mjs';
import { underLoad } from '../support/load.mjs';

const n = Number(process.env.CONNECTIONS ?? 60), seconds = n > 100 ? 15 : 2;

test(`${n} connections with fits running`, { timeout: 180000 * slowness }, async (t) => {
  const daemon = await startDaemon(t, { args: ['--workers', '2', '--connections', String(n + 200), '--log-level', 'warning'] }), folder = temporaryFolder(t);
  assert.equal((await groomctl(null, ['sample', '--style', 'curly', '--strands', slowness > 1 ? '6000' : '40000', '-o', folder])).status, 0);
  const jobs = [];
  for (const seed of ['1', '2', '3', '4']) {
    const fit = await groomctl(daemon, ['--json', 'fit', join(folder, 'strands.hair'), '--head-file', join(folder, 'head.obj'), '--guides', slowness > 1 ? '600' : '1500', '--seed', seed]);
    assert.equal(fit.status, 0, fit.stderr);
    jobs.push(fit.lines().at(-1).id);
  }
  await until('two fits run', async () => (await daemon.json('/v1/jobs?state=running')).jobs.length === 2, 60000);
  const found = await underLoad(daemon, { streams: n / 2, slow: n / 10, idle: n * 0.4, seconds, job: jobs.at(-1) });
  const running = (await daemon.json('/v1/jobs?state=running')).jobs.length;
  t.diagnostic(`how: ${n / 2} event streams of a queued job, ${n / 10} senders of a byte a second, ${n * 0.4} idle; ${running} fits of 40 000 strands running all the while, beside all else that this machine does; one process asks GET /v1/jobs/{id} on one connection 5 ms after each answer for ${seconds} s, and times from the request's write to the answer's last byte; load average ${loadavg()[0].toFixed(1)} on ${cpus().length} processors`);
  t.diagnostic(`status: ${found.n} answers, p50 ${found.p50_ms.toFixed(2)} ms, p99 ${found.p99_ms.toFixed(2)} ms, longest ${found.max_ms.toFixed(1)} ms (a process that only echoes, with the same load: p99 ${found.machine_p99_ms.toFixed(2)} ms); ${found.n_open} connections, ${found.n_cut} cut and opened again`);
  t.diagnostic(`the daemon: ${found.rss_mb.toFixed(0)} MB, ${found.peak_mb.toFixed(0)} MB at most, ${found.n_fd} descriptors`);
  assert.ok(found.n_open >= n * 0.99, `${found.n_open} of ${n}`);
  assert.ok(found.n > 20);
  if (slowness === 1) assert.equal(running, 2, 'the fits ended too early for this to tell anything');
  assert.ok(slowness > 1 || found.peak_mb < 100 + n, `${found.peak_mb} MB`);
  for (const job of jobs) await groomctl(daemon, ['cancel', job]);
});
