// Fits on a Slurm cluster of two nodes (make test-cluster): the same bits as on this machine, whatever
// happens to a node, a worker or the daemon meanwhile.
import assert from 'node:assert/strict';
import { mkdtempSync, rmSync } from 'node:fs';
import net from 'node:net';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import { after, before, test } from 'node:test';

import { groomctl, startDaemon, until } from '../support/daemon.mjs';
import { startCluster } from './slurm.mjs';

const options = { timeout: 600000 }, whole = { timeout: 3600000 };
const size = process.env.CLUSTER_STRANDS ?? '20000', guides = process.env.CLUSTER_GUIDES ?? '1000';
let folder, undisturbed;

async function json(daemon, args) {
  const result = await groomctl(daemon, ['--json', ...args]);
  assert.equal(result.status, 0, `${args.join(' ')}\n${result.stderr}${result.stdout}`);
  return result.lines();
}

async function submit(daemon) {
  const [strands] = await json(daemon, ['upload', join(folder, 'strands.hair')]);
  const [head] = await json(daemon, ['upload-head', join(folder, 'head.obj')]);
  return (await json(daemon, ['fit', strands.id, '--head', head.id, '--guides', guides]))[0].id;
}

async function ended(daemon, job) {
  return until('the job ends', async () => {
    const state = await daemon.json(`/v1/jobs/${job}`);
    return ['succeeded', 'failed', 'cancelled'].includes(state.state) && state;
  }, 400000);
}

async function strandsOf(daemon, state) {
  assert.equal(state.state, 'succeeded', JSON.stringify(state.error));
  return Buffer.from(await (await daemon.fetch(`/v1/grooms/${state.result.groom}/strands?format=hair`)).arrayBuffer());
}

/** Until the fit is in its middle, with something kept to go on from. */
function midway(daemon, job, checkpoints = 1) {
  return until('the job is in its middle', async () => {
    const state = await daemon.json(`/v1/jobs/${job}`);
    assert.ok(['queued', 'running'].includes(state.state), `the job is too short for this test: ${state.state}`);
    return state.progress > 0.05 && (daemon.log().match(/"path":"\/v1\/work\/checkpoint","status":204/g) ?? []).length >= checkpoints;
  }, 120000);
}

function freePort() {
  return new Promise((done) => {
    const server = net.createServer().listen(0, '127.0.0.1', () => { const { port } = server.address(); server.close(() => done(port)); });
  });
}

/** A daemon that keeps its address through a restart: its workers come back to it. */
async function startOnCluster(t, cluster, args = []) {
  return startDaemon(t, { env: cluster.env, args: ['--launcher', 'slurm', '--listen', `127.0.0.1:${await freePort()}`, '--workers', '2', '--worker-threads', '1', '--slurm-interval', '1', ...args] });
}

before(async () => {
  folder = mkdtempSync(join(tmpdir(), 'groomd-sample-'));
  assert.equal((await groomctl(null, ['sample', '--style', 'curly', '--strands', size, '--seed', '9', '-o', folder])).status, 0);
});
after(() => rmSync(folder, { recursive: true, force: true }));

test('on this machine', options, async (t) => {
  const daemon = await startDaemon(t, { args: ['--worker-threads', '1'] });
  undisturbed = await strandsOf(daemon, await ended(daemon, await submit(daemon)));
});

test('on a cluster', whole, async (t) => {
  const cluster = await startCluster(t);

  await t.test('two fits run on two nodes and end with the same bits', options, async (t) => {
    const daemon = await startOnCluster(t, cluster), jobs = [await submit(daemon), await submit(daemon)];
    const nodes = await until('both run', () => {
      const running = cluster.jobs().filter(({ state, name }) => state === 'RUNNING' && jobs.some((job) => name === `${job}.1`));
      return running.length === 2 && running.map(({ node }) => node).sort();
    }, 60000);
    assert.deepEqual(nodes, ['d1', 'd2']);
    for (const job of jobs) assert.ok((await strandsOf(daemon, await ended(daemon, job))).equals(undisturbed), 'the same bits');
  });

  await t.test('a node dies in the middle: Slurm starts the attempt again, which goes on from its checkpoint', options, async (t) => {
    const daemon = await startOnCluster(t, cluster), job = await submit(daemon);
    await midway(daemon, job);
    const { node } = cluster.jobs().find(({ name, state }) => name === `${job}.1` && state === 'RUNNING');
    await cluster.kill(node);
    t.diagnostic(`killed ${node}`);
    const state = await ended(daemon, job);
    assert.ok((await strandsOf(daemon, state)).equals(undisturbed), 'the same bits');
    assert.equal(state.attempt, 1, 'Slurm started the same attempt again');
    const again = cluster.jobs().find(({ name }) => name === `${job}.1`);
    assert.equal(again.restarts, 1);
    assert.notEqual(again.node, node);
    assert.match(daemon.log(), /"path":"\/v1\/work\/blobs\/[^"]*","status":200[^]*"path":"\/v1\/work\/job"[^]*"path":"\/v1\/work\/blobs\//, 'it asked for its order twice');
    cluster.startNode(node);
    await until('the node is back', () => cluster.run('sinfo', ['--noheader', '--Node', `--nodes=${node}`, '--format=%T']).trim() === 'idle', 60000);
  });

  await t.test('the daemon is killed and started again: the worker never notices', options, async (t) => {
    const daemon = await startOnCluster(t, cluster), job = await submit(daemon);
    await midway(daemon, job);
    await daemon.kill();
    await new Promise((done) => setTimeout(done, 1500));
    await daemon.start();
    const state = await ended(daemon, job);
    assert.ok((await strandsOf(daemon, state)).equals(undisturbed), 'the same bits');
    assert.equal(state.attempt, 1);
    assert.equal(cluster.jobs().find(({ name }) => name === `${job}.1`).restarts, 0);
  });

  await t.test('a worker is killed: another attempt goes on, and the first one says how it died', options, async (t) => {
    const daemon = await startOnCluster(t, cluster), job = await submit(daemon);
    await midway(daemon, job);
    const [pid] = cluster.processes(cluster.jobs().filter(({ name, state }) => name === `${job}.1` && state === 'RUNNING')).slice(-1);
    process.kill(pid, 'SIGKILL');
    const state = await ended(daemon, job);
    assert.ok((await strandsOf(daemon, state)).equals(undisturbed), 'the same bits');
    assert.equal(state.attempt, 2);
  });

  await t.test('cancelling takes it off the cluster', options, async (t) => {
    const daemon = await startOnCluster(t, cluster), job = await submit(daemon);
    await midway(daemon, job);
    const from = Date.now();
    assert.equal((await groomctl(daemon, ['cancel', job])).status, 0);
    await until('no process is left', () => cluster.processes(cluster.jobs().filter(({ name }) => name === `${job}.1`)).length === 0);
    t.diagnostic(`${Date.now() - from} ms until no process is left`);
    assert.equal((await ended(daemon, job)).state, 'cancelled');
  });

  await t.test('with a shared folder nothing goes over HTTP that is there', options, async (t) => {
    const daemon = await startOnCluster(t, cluster);
    await daemon.stop();
    daemon.args.push('--work-folder', daemon.data);
    await daemon.start();
    const job = await submit(daemon);
    assert.ok((await strandsOf(daemon, await ended(daemon, job))).equals(undisturbed), 'the same bits');
    assert.doesNotMatch(daemon.log(), /"path":"\/v1\/work\/blobs\//);
  });
});
