// Messages of a job's end: signed, tried again, kept over a restart, never to private addresses unless allowed.
import test from 'node:test';
import assert from 'node:assert/strict';
import { createHmac } from 'node:crypto';
import http from 'node:http';
import { expect, refused, startIdleDaemon, upload } from '../support/api.mjs';
import { until } from '../support/daemon.mjs';

const secret = 'a-secret-of-this-test';

/** A receiver: what it heard, and what it answers next. */
async function receiver(t, answers = []) {
  const heard = [];
  const server = http.createServer((request, response) => {
    const pieces = [];
    request.on('data', (piece) => pieces.push(piece)).on('end', () => {
      heard.push({ url: request.url, headers: request.headers, body: Buffer.concat(pieces).toString(), at: Date.now() });
      const answer = answers.shift() ?? { status: 204 };
      if (answer.hang) return;
      response.writeHead(answer.status, answer.headers ?? {}).end(answer.body ?? '');
    });
  });
  await new Promise((done) => server.listen(0, '127.0.0.1', done));
  t.after(() => { server.closeAllConnections(); server.close(); });
  return { heard, answers, url: `http://127.0.0.1:${server.address().port}/hook` };
}

function verify({ headers, body }, key = secret) {
  const text = `${headers['webhook-id']}.${headers['webhook-timestamp']}.${body}`;
  assert.equal(headers['webhook-signature'], `v1,${createHmac('sha256', key).update(text).digest('base64')}`);
  assert.ok(Math.abs(Date.now() / 1000 - Number(headers['webhook-timestamp'])) < 60);
  assert.equal(headers['content-type'], 'application/json');
}

const submit = async (daemon, webhook) => {
  const { id } = await upload(daemon);
  return (await expect(daemon, 202, 'POST', '/v1/jobs', { body: { kind: 'fit', strands: id, webhook } })).json;
};
/** The daemon's one worker never ends by itself: a job ends when it is cancelled. */
const end = (daemon, job) => daemon.fetch(`/v1/jobs/${job.id}`, { method: 'DELETE' });
const deliveries = async (daemon, job) => (await expect(daemon, 200, 'GET', `/v1/jobs/${job.id}/deliveries`)).json.deliveries;

test('a message at the end of a job, signed', async (t) => {
  const hook = await receiver(t), every = await receiver(t);
  const daemon = await startIdleDaemon(t, { args: ['--webhook-allow', '127.0.0.1', '--webhook-url', every.url, '--webhook-secret', 'whsec_MfKQ9r8GKYqrTwjUPD8ILPZIo2LaLaSw'] });
  const job = await submit(daemon, { url: hook.url, secret });
  assert.ok(!JSON.stringify(job).includes(secret));
  assert.deepEqual((await deliveries(daemon, job)).map(({ state, attempts, next_attempt_at }) => [state, attempts, next_attempt_at]), [['waiting', 0, null], ['waiting', 0, null]]);
  await end(daemon, job);
  await until('both have heard', () => hook.heard.length && every.heard.length);
  verify(hook.heard[0]);
  verify(every.heard[0], Buffer.from('MfKQ9r8GKYqrTwjUPD8ILPZIo2LaLaSw', 'base64'));
  const message = JSON.parse(hook.heard[0].body);
  assert.equal(message.type, 'job.cancelled');
  assert.deepEqual(message.data, (await expect(daemon, 200, 'GET', `/v1/jobs/${job.id}`)).json);
  const done = await until('both are delivered', async () => { const list = await deliveries(daemon, job); return list.every(({ state }) => state === 'delivered') && list; });
  for (const one of done) assert.deepEqual([one.attempts, one.last_status, one.next_attempt_at], [1, 204, null]);
  assert.ok(!JSON.stringify(done).includes(secret));
  assert.ok(!daemon.log().includes(secret), 'the log has no secrets');
  await new Promise((rest) => setTimeout(rest, 1200));
  assert.equal(hook.heard.length, 1, 'once');
});

test('tried again, over a restart too; redirects are not followed; 410 ends it', async (t) => {
  const hook = await receiver(t, [{ status: 500 }, { hang: true }]), elsewhere = await receiver(t);
  const moved = await receiver(t, [{ status: 302, headers: { Location: elsewhere.url } }]), gone = await receiver(t, [{ status: 410 }]);
  const daemon = await startIdleDaemon(t, { args: ['--webhook-allow', '127.0.0.0/8', '--webhook-attempts', '5', '--webhook-timeout', '2'] });
  const jobs = [];
  for (const { url } of [hook, moved, gone]) jobs.push(await submit(daemon, { url, secret }));
  for (const job of jobs) await end(daemon, job);
  await until('all have heard', () => hook.heard.length && moved.heard.length && gone.heard.length);
  await until('it is noted', async () => (await deliveries(daemon, jobs[0]))[0].last_status === 500);
  const [first] = await deliveries(daemon, jobs[0]);
  assert.equal(first.state, 'waiting');
  assert.match(first.last_error, /answered 500/);
  assert.ok(first.next_attempt_at);
  const [away] = await until('it is noted', async () => { const list = await deliveries(daemon, jobs[1]); return list[0].last_status && list; });
  assert.match(away.last_error, /answered 302, and redirects are not followed/);
  assert.equal(elsewhere.heard.length, 0);
  assert.equal((await until('it is noted', async () => { const list = await deliveries(daemon, jobs[2]); return list[0].last_status && list; }))[0].state, 'given_up');
  // killed while the second try hangs: the third comes from the next daemon, with the same id
  await until('the second try', () => hook.heard.length === 2);
  await daemon.kill();
  await daemon.start();
  await until('the third try', () => hook.heard.length === 3, 60000);
  assert.equal(new Set(hook.heard.map(({ headers }) => headers['webhook-id'])).size, 1);
  for (const one of hook.heard) verify(one);
  assert.ok(hook.heard[1].at - hook.heard[0].at >= 4000, 'with a pause');
  await until('it is delivered', async () => (await deliveries(daemon, jobs[0]))[0].state === 'delivered');
});

test('not to private addresses, by number or by name', async (t) => {
  const hook = await receiver(t);
  const daemon = await startIdleDaemon(t);
  const { id } = await upload(daemon);
  const bad = (webhook, pointer) => refused(daemon, 400, 'invalid-argument', 'POST', '/v1/jobs', { body: { kind: 'fit', strands: id, webhook }, problem: { pointer } });
  await bad({ url: hook.url, secret }, '/webhook/url');
  await bad({ url: 'http://169.254.169.254/latest', secret }, '/webhook/url');
  await bad({ url: 'http://[::1]/', secret }, '/webhook/url');
  await bad({ url: 'gopher://example.com/', secret }, '/webhook/url');
  await bad({ url: 'https://example.com/' }, '/webhook/secret');
  await bad({ url: 'https://example.com/', secret: 'short' }, '/webhook/secret');
  await bad({ secret }, '/webhook/url');
  await bad('https://example.com/', '/webhook');
  // a name is looked at when it has become an address
  const job = await submit(daemon, { url: hook.url.replace('127.0.0.1', 'localhost'), secret });
  await end(daemon, job);
  const [refusal] = await until('it was tried', async () => { const list = await deliveries(daemon, job); return list[0].last_error && list; });
  assert.match(refusal.last_error, /private network's \(--webhook-allow\)/);
  assert.equal(refusal.last_status, null);
  assert.equal(hook.heard.length, 0);
});
