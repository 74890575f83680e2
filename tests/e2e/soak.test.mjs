// The service under a steady mixture of uploads, fits, edits, exports and broken connections: memory and
// file descriptors stay where they are.
//   SOAK_SECONDS (6; make soak takes SOAK_MINUTES)
import assert from 'node:assert/strict';
import { test } from 'node:test';
import { setTimeout as sleep } from 'node:timers/promises';

import { raw } from '../support/api.mjs';
import { slowness, startDaemon, until } from '../support/daemon.mjs';
import { Workload } from '../support/kills.mjs';
import { descriptors_of, status_of } from '../support/load.mjs';

const seconds = Number(process.env.SOAK_SECONDS ?? 6), pace_ms = Number(process.env.SOAK_PACE_MS ?? 30);

/** What else clients do: previews, exports, lists, metrics, and lines that break in the middle. */
async function visit(workload, next) {
  const grooms = [...workload.grooms.keys()], groom = grooms[Math.floor(next() * grooms.length)];
  const paths = ['/metrics', '/v1/jobs?limit=20', '/v1/options', '/status', ...(groom ? [`/v1/grooms/${groom}/strands?format=hair`, `/v1/grooms/${groom}/revisions`, `/v1/grooms/${groom}`] : [])];
  const path = paths[Math.floor(next() * paths.length)];
  if (next() < 0.3) await raw(workload.daemon, `${next() < 0.5 ? 'GET' : 'POST'} ${path} HTTP/1.1\r\nHost: localhost\r\nContent-Length: ${next() < 0.5 ? 0 : 1000}\r\n\r\nx`, 30);
  else workload.told(await workload.ask('GET', path), [200], path);
}

test(`${seconds} s of a steady mixture leave memory and descriptors flat`, { timeout: (seconds * 3000 + 240000) * slowness }, async (t) => {
  const daemon = await startDaemon(t, { args: ['--workers', '1', '--worker-threads', '1', '--log-level', 'error', '--idle-timeout', '5', '--export-cache', '20M'] });
  const workload = new Workload(daemon, 5), end = Date.now() + seconds * 1000, samples = [];
  const sample = () => samples.push({ at_s: seconds - (end - Date.now()) / 1000, rss_kb: status_of(daemon.child.pid, 'VmRSS'), fd: descriptors_of(daemon.child.pid), threads: status_of(daemon.child.pid, 'Threads') });
  workload.start(2, Math.max(20, seconds * 2));
  for (let i = 0; Date.now() < end; i++) {
    await visit(workload, workload.next);
    await sleep(pace_ms);
    if (i % Math.max(1, Math.floor((seconds * 1000) / pace_ms / 200)) === 0) sample();
  }
  await workload.stop();
  await workload.drain((120000 + seconds * 1000) * slowness);
  const found = await workload.examine();
  await until('connections are closed', () => { sample(); return samples.at(-1).fd < 100; }, 30000);
  // the second half against the first: what grows without an end shows there
  const half = samples.filter(({ at_s }) => at_s > seconds / 2), first = samples.filter(({ at_s }) => at_s > seconds / 10 && at_s <= seconds / 2);
  const mean = (rows, key) => rows.reduce((sum, row) => sum + row[key], 0) / rows.length;
  t.diagnostic(`${JSON.stringify(found)}; ${workload.sent} calls`);
  t.diagnostic(`memory ${(mean(first, 'rss_kb') / 1024).toFixed(1)} MB in the first half, ${(mean(half, 'rss_kb') / 1024).toFixed(1)} MB in the second, ${(samples.at(-1).rss_kb / 1024).toFixed(1)} MB at the end; descriptors ${mean(first, 'fd').toFixed(1)}, ${mean(half, 'fd').toFixed(1)}, ${samples.at(-1).fd}; threads ${samples.at(-1).threads}`);
  assert.ok(mean(half, 'fd') < mean(first, 'fd') + 20);
  if (slowness === 1) assert.ok(mean(half, 'rss_kb') < mean(first, 'rss_kb') * 1.25 + 16384, 'memory grows');
});
