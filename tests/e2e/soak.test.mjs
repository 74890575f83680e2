// The service under a steady mixture of uploads, fits, edits, exports and broken connections: memory and
// file descriptors stay where they are.
//   SOAK_SECONDS (6; make soak takes SOAK_MINUTES), SOAK_PACE_MS (30: how long each of three clients pauses)
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

/** What the daemon holds now. */
const look = (daemon, at_s) => ({ at_s, rss_kb: status_of(daemon.child.pid, 'VmRSS'), fd: descriptors_of(daemon.child.pid), threads: status_of(daemon.child.pid, 'Threads') });
const mean = (rows, key) => rows.reduce((sum, row) => sum + row[key], 0) / rows.length;
const words = (rows) => `${(mean(rows, 'rss_kb') / 1024).toFixed(1)} MB, ${mean(rows, 'fd').toFixed(1)} descriptors, ${mean(rows, 'threads').toFixed(1)} threads`;

test(`${seconds} s of a steady mixture leave memory and descriptors flat`, { timeout: (seconds * 3000 + 240000) * slowness }, async (t) => {
  const daemon = await startDaemon(t, { args: ['--workers', '1', '--worker-threads', '1', '--log-level', 'error', '--idle-timeout', '5', '--export-cache', '20M'] });
  const workload = new Workload(daemon, 5), start = Date.now(), tenths = Array.from({ length: 10 }, () => []);
  const now_s = () => (Date.now() - start) / 1000;
  workload.max_waiting = 10;
  workload.start(2, Math.max(20, seconds * 2), pace_ms * 0.8);
  for (let i = 0, told = 0; now_s() < seconds; i++) {
    await visit(workload, workload.next);
    await sleep(pace_ms);
    const tenth = Math.min(9, Math.floor((now_s() * 10) / seconds));
    if (i % Math.max(1, Math.floor((seconds * 1000) / pace_ms / 500)) === 0) tenths[tenth].push(look(daemon, now_s()));
    for (; seconds >= 300 && told < tenth; told++) console.log(`after ${Math.round(now_s())} s: ${words(tenths[told])}; ${workload.sent} calls`);
  }
  await workload.stop();
  await workload.drain((120000 + seconds * 1000) * slowness);
  const found = await workload.examine();
  let last;
  await until('connections are closed', () => { last = look(daemon, now_s()); return last.fd < 100; }, 30000);
  t.diagnostic(`${JSON.stringify(found)}; ${workload.sent} calls`);
  for (const [name, i] of [['second', 1], ['fifth', 4], ['last', 9]]) t.diagnostic(`the ${name} tenth: ${words(tenths[i])}`);
  t.diagnostic(`at the end, looked through: ${words([last])}`);
  // what grows without an end shows in the second half; the first tenth is for caches to fill
  const first = tenths.slice(1, 5).flat(), second = tenths.slice(5).flat(), slack = seconds >= 300 ? 1.1 : 1.25;
  assert.ok(mean(second, 'fd') < mean(first, 'fd') + 20, `${words(first)}; then ${words(second)}`);
  if (slowness === 1) assert.ok(mean(second, 'rss_kb') < mean(first, 'rss_kb') * slack + 16384, `memory grows: ${words(first)}; then ${words(second)}`);
});
