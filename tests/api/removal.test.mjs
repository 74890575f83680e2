// What users remove, and what goes by itself.
import test from 'node:test';
import assert from 'node:assert/strict';
import { readdirSync } from 'node:fs';
import { join } from 'node:path';
import { groomctl, startDaemon, until } from '../support/daemon.mjs';
import { expect, groom_document, hair, head_obj, refused, startIdleDaemon, submit, upload } from '../support/api.mjs';

const blobs_of = (daemon) => readdirSync(join(daemon.data, 'blobs'), { recursive: true }).filter((name) => /[0-9a-f]{60}/.test(name));

test('strands and heads go with their bytes, unless a job needs them', async (t) => {
  const daemon = await startIdleDaemon(t);
  const strands = await upload(daemon);
  const cm = (await expect(daemon, 201, 'POST', '/v1/strands?unit=cm', { body: hair(20, 10) })).json;
  const head = (await expect(daemon, 201, 'POST', '/v1/heads', { body: head_obj() })).json;
  const job = await submit(daemon, { head: head.id });
  assert.equal(job.request?.strands ?? strands.id, strands.id);
  await refused(daemon, 409, 'conflict', 'DELETE', `/v1/strands/${strands.id}`, { problem: { detail: new RegExp(job.id) } });
  await refused(daemon, 409, 'conflict', 'DELETE', `/v1/heads/${head.id}`);
  await expect(daemon, 200, 'GET', `/v1/heads/${head.id}/data`);
  await expect(daemon, 202, 'DELETE', `/v1/jobs/${job.id}`);
  await until('the job has ended', async () => (await expect(daemon, 200, 'GET', `/v1/jobs/${job.id}`)).json.state === 'cancelled');
  await expect(daemon, 204, 'DELETE', `/v1/heads/${head.id}`);
  await refused(daemon, 404, 'not-found', 'DELETE', `/v1/heads/${head.id}`);
  await refused(daemon, 404, 'not-found', 'GET', `/v1/heads/${head.id}`);
  assert.equal(blobs_of(daemon).length, 1, 'the head\'s blob is gone');
  await expect(daemon, 204, 'DELETE', `/v1/strands/${strands.id}`);
  assert.equal(blobs_of(daemon).length, 1, 'the same bytes read in another way');
  await expect(daemon, 200, 'GET', `/v1/strands/${cm.id}/data?unit=cm`);
  await refused(daemon, 404, 'not-found', 'DELETE', `/v1/heads/${cm.id}`);
  const { status, stderr } = await groomctl(daemon, ['delete', cm.id]);
  assert.equal(status, 0, stderr);
  assert.deepEqual(blobs_of(daemon), []);
  assert.equal((await groomctl(daemon, ['delete', cm.id])).status, 1);
  assert.equal((await groomctl(daemon, ['delete', job.id])).status, 2);
  assert.equal((await expect(daemon, 201, 'POST', '/v1/strands', { body: hair(20, 10) })).json.id, strands.id);
});

test('grooms go whole, and leave what others share', async (t) => {
  const daemon = await startDaemon(t);
  const create = async () => (await expect(daemon, 201, 'POST', '/v1/grooms', { body: groom_document() })).json.groom;
  const one = await create(), two = await create();
  await expect(daemon, 201, 'PATCH', `/v1/grooms/${one}`, { headers: { 'Content-Type': 'application/merge-patch+json', 'If-Match': '"1"' }, body: { name: 'other' } });
  await refused(daemon, 412, 'precondition-failed', 'DELETE', `/v1/grooms/${one}`, { headers: { 'If-Match': '"1"' } });
  await expect(daemon, 204, 'DELETE', `/v1/grooms/${one}`, { headers: { 'If-Match': '"2"' } });
  await refused(daemon, 404, 'not-found', 'GET', `/v1/grooms/${one}`);
  await refused(daemon, 404, 'not-found', 'GET', `/v1/grooms/${one}?revision=1`);
  await refused(daemon, 404, 'not-found', 'DELETE', `/v1/grooms/${one}`);
  assert.equal((await expect(daemon, 200, 'GET', `/v1/grooms/${two}?arrays=true`)).json.strands.count, 24);
  await expect(daemon, 204, 'DELETE', `/v1/grooms/${two}`);
  assert.deepEqual((await expect(daemon, 200, 'GET', '/v1/grooms')).json.grooms, []);
  await create();
});
