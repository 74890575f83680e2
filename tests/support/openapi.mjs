// The API's own description as a judge: every answer that a test gets is checked against
// proto/openapi.yaml, and what was exercised is remembered.
//
//   node tests/support/openapi.mjs --write    makes proto/openapi.json from the YAML
//   node tests/support/openapi.mjs --check    says whether they are equal
import { readFileSync, writeFileSync } from 'node:fs';
import { dirname, join, resolve } from 'node:path';
import { fileURLToPath } from 'node:url';
import assert from 'node:assert/strict';
import Ajv from 'ajv/dist/2020.js';
import addFormats from 'ajv-formats';
import YAML from 'yaml';

const top = resolve(dirname(fileURLToPath(import.meta.url)), '../..');
const yaml_path = join(top, 'proto/openapi.yaml'), json_path = join(top, 'proto/openapi.json');
export const document = YAML.parse(readFileSync(yaml_path, 'utf8'));

const ajv = new Ajv({ strict: false, allErrors: true });
addFormats(ajv);
ajv.addSchema({ $id: 'api', ...document });

/** A node, or what its $ref names. */
export const resolved = (node) => (node?.$ref ? node.$ref.slice(2).split('/').reduce((at, key) => at[key], document) : node);

/** [{ method, path, pattern, operation }] of everything that is described. */
export const operations = Object.entries(document.paths).flatMap(([path, item]) =>
  ['get', 'post', 'put', 'patch', 'delete', 'options'].filter((method) => item[method]).map((method) => ({
    method: method.toUpperCase(), path, operation: item[method],
    pattern: new RegExp(`^${path.replace(/[.]/g, '\\.').replace(/\{[^}]+\}/g, '[^/]+')}$`),
  })));

export function operation_of(method, path) {
  const wanted = method === 'HEAD' ? 'GET' : method;
  return operations.find((entry) => entry.method === wanted && entry.pattern.test(path));
}

const compiled = new Map();
function validator(schema) {
  const key = JSON.stringify(schema);
  if (!compiled.has(key)) {
    // references inside the document, seen from a schema of its own
    const absolute = JSON.parse(key, (name, value) => (name === '$ref' ? `api${value}` : value));
    compiled.set(key, ajv.compile(absolute));
  }
  return compiled.get(key);
}

function check_schema(schema, value, what) {
  const validate = validator(schema);
  assert.ok(validate(value), `${what}: ${ajv.errorsText(validate.errors)}\n${JSON.stringify(value)?.slice(0, 2000)}`);
}

function media_of(content, type) {
  const bare = (type ?? '').split(';')[0].trim();
  return content[bare] ?? (bare.endsWith('+json') ? content['application/json'] : undefined) ?? content['*/*'];
}

const exercised = new Map();
/** operationId -> Set of statuses that were answered to a test. */
export const seen = exercised;

/** Fails where the answer is not one that the document describes. body: Buffer. */
export function check_answer(method, path, status, headers, body) {
  const found = operation_of(method, path);
  const what = `${method} ${path} -> ${status}`;
  const problem = { content: { 'application/problem+json': { schema: { $ref: '#/components/schemas/Problem' } } } };
  let response = found ? resolved(found.operation.responses[String(status)]) : undefined;
  if (!response && status >= 400) response = problem; // 404 of no path, 405, `default`
  assert.ok(response, `${what} is not described`);
  if (found) {
    if (!exercised.has(found.operation.operationId)) exercised.set(found.operation.operationId, new Set());
    exercised.get(found.operation.operationId).add(status);
  }
  for (const [name, header] of Object.entries(response.headers ?? {})) {
    const { required, schema } = resolved(header), value = headers.get(name);
    if (required) assert.ok(value, `${what}: the header ${name} is missing`);
    if (value !== null) check_schema(schema, value, `${what}: ${name}`);
  }
  assert.match(headers.get('x-request-id') ?? '', /^[0-9a-f]{8,}$/, `${what}: X-Request-Id`);
  if (method === 'HEAD' || status === 204 || status === 304) {
    assert.equal(body.length, 0, `${what} has a body`);
    return;
  }
  if (!response.content && status < 400) {
    assert.equal(body.length, 0, `${what} has a body`);
    return;
  }
  const type = headers.get('content-type');
  const media = media_of(response.content ?? {}, type);
  assert.ok(media, `${what}: Content-Type ${type} is not described`);
  if (type.split(';')[0].endsWith('json')) {
    const value = JSON.parse(body.toString());
    if (media.schema) check_schema(media.schema, value, what);
    if (status >= 400) assert.equal(value.status, status, `${what}: the problem says another status`);
  }
}

if (process.argv[1] === fileURLToPath(import.meta.url)) {
  const text = JSON.stringify(document) + '\n';
  if (process.argv[2] === '--write') writeFileSync(json_path, text);
  else if (readFileSync(json_path, 'utf8') !== text) {
    console.error('proto/openapi.json is not proto/openapi.yaml: run node tests/support/openapi.mjs --write');
    process.exit(1);
  }
}
