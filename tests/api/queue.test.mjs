// The queue as clients see it: whose turn it is, and what becomes of a job whose workers die.
import test from 'node:test';
import assert from 'node:assert/strict';
import { readdirSync, readFileSync } from 'node:fs';
import { join } from 'node:path';
import { build, run, until } from '../support/daemon.mjs';
import { call, events, expect, hair, startIdleDaemon, submit } from '../support/api.mjs';

async function token(daemon, name, ...options) {
  const { stdout } = await run(join(build, 'groomd'), ['token', 'create', '--data', daemon.data, '--name', name, '--json', ...options]);
  return JSON.parse(stdout).token;
}

/** The only worker, which is a sleep (startIdleDaemon). */
function sleeper(daemon) {
  const tasks = readdirSync(`/proc/${daemon.child.pid}/task`);
  const children = tasks.flatMap((task) => readFileSync(`/proc/${daemon.child.pid}/task/${task}/children`, 'utf8').split(' ').filter(Boolean).map(Number));
  return children.find((pid) => readFileSync(`/proc/${pid}/cmdline`, 'utf8').includes('sleep'));
}

/** The job of the next attempt; it is over then. */
async function next_turn(daemon) {
  const attempt = await daemon.attempt();
  const { job } = (await expect(daemon, 200, 'GET', '/v1/work/job', { token: attempt })).json;
  await expect(daemon, 204, 'POST', '/v1/work/failed', { token: attempt, body: { type: '/problems/empty', title: 'x', status: 422, detail: 'x' } });
  process.kill(sleeper(daemon), 'SIGKILL'); // which has nothing left to do
  return job;
}

test('priority first, then tokens in turn, then age; positions say so beforehand', async (t) => {
  const daemon = await startIdleDaemon(t);
  const [ann, bob, admin] = [await token(daemon, 'ann'), await token(daemon, 'bob'), await token(daemon, 'admin', '--scopes', 'read,submit,admin')];
  const job = async (who, name, priority) => {
    const strands = (await call(daemon, 'POST', '/v1/strands', { body: hair(4, 4), token: who })).json;
    const made = (await expect(daemon, 202, 'POST', '/v1/jobs', { body: { kind: 'fit', strands: strands.id, ...(priority && { priority }) }, token: who })).json;
    return { name, who, id: made.id };
  };
  const first = await job(ann, 'ann 0'); // runs while the others queue
  await until('it runs', async () => (await call(daemon, 'GET', `/v1/jobs/${first.id}`, { token: ann })).json.state === 'running');
  const jobs = [];
  for (const [who, name, priority] of [[ann, 'ann 1'], [ann, 'ann 2'], [ann, 'ann 3'], [bob, 'bob 1'], [bob, 'bob 2', -1], [admin, 'first', 5], [bob, 'bob 3']])
    jobs.push(await job(who, name, priority));
  const places = [];
  for (const { who, id, name } of jobs) places[(await call(daemon, 'GET', `/v1/jobs/${id}`, { token: who })).json.queue_position] = name;
  const wanted = ['first', 'bob 1', 'ann 1', 'bob 3', 'ann 2', 'ann 3', 'bob 2'];
  assert.equal(await next_turn(daemon), first.id);
  const taken = [];
  while (taken.length < jobs.length) {
    const id = await next_turn(daemon);
    taken.push(jobs.find((one) => one.id === id).name);
  }
  assert.deepEqual(taken, wanted);
  // told while one of ann's ran, which counts as a turn of hers as long as it does
  assert.deepEqual(places, ['first', 'bob 1', 'bob 3', 'ann 1', 'ann 2', 'ann 3', 'bob 2']);
});

test('a poison job: attempts with pauses between them, then failed with its whole history', async (t) => {
  const daemon = await startIdleDaemon(t), job = await submit(daemon);
  for (let i = 1; i <= 3; i++) {
    await daemon.attempt();
    process.kill(await until('its worker sleeps', () => sleeper(daemon)), i === 2 ? 'SIGSEGV' : 'SIGKILL');
  }
  const failed = (await expect(daemon, 200, 'GET', `/v1/jobs/${job.id}`, { headers: { Prefer: 'wait=20' } })).json;
  assert.equal(failed.state, 'failed');
  assert.equal(failed.error.type, '/problems/worker-died');
  assert.match(failed.error.detail, /^3 attempts died without getting further; the last one ended with signal 9/);
  assert.deepEqual(failed.error.attempts.map(({ attempt, state, last_words }) => [attempt, state, last_words]),
    [[1, 'died', 'signal 9 (Killed)'], [2, 'died', 'signal 11 (Segmentation fault)'], [3, 'died', 'signal 9 (Killed)']]);
  const begun = failed.error.attempts.map(({ started_at }) => Date.parse(started_at));
  assert.ok(begun[1] - begun[0] >= 500 && begun[2] - begun[1] >= 1000, `pauses of 0.5 s and 1 s: ${begun}`);
  const states = (await events(daemon, `/v1/jobs/${job.id}/events`)).filter(({ event }) => event === 'state').map(({ data }) => data.state);
  assert.deepEqual(states, ['queued', 'running', 'queued', 'running', 'queued', 'running', 'failed']);
  assert.match((await call(daemon, 'GET', '/metrics')).text, /^groomd_worker_restarts_total 3$/m);
});
