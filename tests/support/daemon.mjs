// The fixture of the black-box tests: a groomd of its own on a free port with an empty folder, and
// groomctl to talk to it. It waits until the daemon is ready, fails on a sanitizer's word in the
// log, and leaves nothing behind.
//
//   const daemon = await startDaemon(t);            // stopped and checked when the test ends
//   const { status, stdout } = await groomctl(daemon, ['list', 'jobs']);
//   const response = await daemon.fetch('/v1/jobs');
import { spawn } from 'node:child_process';
import { existsSync, mkdtempSync, readFileSync, openSync, closeSync, rmSync, readdirSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { dirname, join, resolve } from 'node:path';
import { fileURLToPath } from 'node:url';
import { setTimeout as sleep } from 'node:timers/promises';

const top = resolve(dirname(fileURLToPath(import.meta.url)), '../..');
export const build = resolve(top, process.env.BUILD ?? 'build');
/** Under a sanitizer everything takes longer; limits of time are multiplied by this. */
export const slowness = /(asan|tsan)$/.test(build) ? 8 : 1;

const alive = new Set();
process.on('exit', () => { for (const child of alive) child.kill('SIGKILL'); });

/** A folder that is removed when the test ends. */
export function temporaryFolder(t) {
  const folder = mkdtempSync(join(tmpdir(), 'groomd-test-'));
  t.after(() => rmSync(folder, { recursive: true, force: true }));
  return folder;
}

/** A real capture in ../shared/data (GROOM_SHARED names another place), or null. */
export function sharedData(relative) {
  const path = resolve(process.env.GROOM_SHARED ?? join(top, '../shared'), 'data', relative);
  return existsSync(path) ? path : null;
}

/** Polls until `look` answers something truthy; fails with `what` after so many milliseconds. */
export async function until(what, look, timeout_ms = 30000) {
  const end = Date.now() + timeout_ms * slowness;
  for (;;) {
    const answer = await look();
    if (answer) return answer;
    if (Date.now() > end) throw new Error(`waited ${timeout_ms * slowness} ms in vain: ${what}`);
    await sleep(20);
  }
}

const bad_words = /AddressSanitizer|ThreadSanitizer|LeakSanitizer|UndefinedBehavior|runtime error:/;

function logs_of(folder) {
  const found = [];
  for (const entry of readdirSync(folder, { withFileTypes: true, recursive: false })) {
    const path = join(folder, entry.name);
    if (entry.isDirectory()) found.push(...logs_of(path));
    else if (entry.name.endsWith('.log')) found.push(path);
  }
  return found;
}

export class Daemon {
  constructor(folder, args, env) {
    Object.assign(this, { folder, args, env, data: join(folder, 'data'), log_path: join(folder, 'groomd.log'), url: null, child: null });
  }

  /** Start, or start again on the same data; resolves when it is ready. */
  async start() {
    const log = openSync(this.log_path, 'a');
    const args = ['--data', this.data, '--listen', '127.0.0.1:0', ...this.args];
    const child = spawn(join(build, 'groomd'), args, { stdio: ['ignore', 'pipe', log], env: { ...process.env, ...this.env } });
    closeSync(log);
    alive.add(child);
    this.child = child;
    this.ended = new Promise((done) => child.on('exit', (code, signal) => { alive.delete(child); done({ code, signal }); }));
    let output = '';
    child.stdout.setEncoding('utf8').on('data', (text) => { output += text; });
    this.url = await until(`groomd says where it listens; its log:\n${this.log()}`, () => {
      if (child.exitCode !== null || child.signalCode !== null) throw new Error(`groomd ended with ${child.exitCode ?? child.signalCode}:\n${this.log()}`);
      return /^listening on (\S+)\n/.exec(output)?.[1];
    });
    await until('groomd is ready', async () => child.signalCode !== null || (await this.fetch('/readyz').catch(() => null))?.ok);
    return this;
  }

  log() { return existsSync(this.log_path) ? readFileSync(this.log_path, 'utf8') : ''; }

  fetch(path, options = {}) {
    const headers = this.token ? { Authorization: `Bearer ${this.token}`, ...options.headers } : options.headers;
    return fetch(new URL(path, this.url), { signal: AbortSignal.timeout(60000 * slowness), ...options, headers });
  }

  async json(path, options) { return (await this.fetch(path, options)).json(); }

  /** Process ids of its children: the workers that run now. */
  workers() {
    try {
      const tasks = readdirSync(`/proc/${this.child.pid}/task`);
      return tasks.flatMap((task) => readFileSync(`/proc/${this.child.pid}/task/${task}/children`, 'utf8').split(' ').filter(Boolean).map(Number))
        .filter((pid) => readFileSync(`/proc/${pid}/cmdline`, 'utf8').split('\0').includes('attempt'));
    } catch { return []; }
  }

  /** SIGKILL: no farewell. */
  async kill() {
    this.child.kill('SIGKILL');
    await this.ended;
  }

  /** SIGTERM, and its way to end: { code, signal, ms }. */
  async stop() {
    const from = Date.now();
    if (this.child.exitCode === null && this.child.signalCode === null) this.child.kill('SIGTERM');
    const late = setTimeout(() => this.child.kill('SIGKILL'), 20000 * slowness);
    const how = await this.ended;
    clearTimeout(late);
    return { ...how, ms: Date.now() - from };
  }

  /** Throws where a sanitizer said something, in the daemon's log or in a worker's. */
  check_logs() {
    for (const path of logs_of(this.folder)) {
      const text = readFileSync(path, 'utf8');
      if (bad_words.test(text)) throw new Error(`a sanitizer complains in ${path}:\n${text.slice(Math.max(0, text.search(bad_words) - 200)).slice(0, 4000)}`);
    }
  }
}

/** options: args of groomd, env, prepare(data folder). */
export async function startDaemon(t, { args = [], env = {}, prepare } = {}) {
  const folder = mkdtempSync(join(tmpdir(), 'groomd-test-'));
  const daemon = new Daemon(folder, args, env);
  t.after(async () => {
    const { code, signal } = daemon.child ? await daemon.stop() : {};
    try {
      daemon.check_logs();
      if (code !== 0 && signal !== 'SIGKILL') throw new Error(`groomd ended with ${code ?? signal}:\n${daemon.log().slice(-3000)}`);
    } catch (error) {
      t.diagnostic(error.message); // node shows a test's first failure alone
      throw error;
    } finally {
      rmSync(folder, { recursive: true, force: true });
    }
  });
  await prepare?.(daemon.data); // before it starts
  return daemon.start();
}

/** Runs a program to its end: { status, signal, stdout, stderr, ms, lines() }. */
export function run(program, args, { env = {}, input, timeout_ms = 120000, on_start } = {}) {
  const from = Date.now();
  const child = spawn(program, args, { env: { ...process.env, ...env }, stdio: [input === undefined ? 'ignore' : 'pipe', 'pipe', 'pipe'] });
  const out = [], err = [];
  alive.add(child);
  child.stdout.on('data', (bytes) => out.push(bytes));
  child.stderr.on('data', (bytes) => err.push(bytes));
  if (input !== undefined) child.stdin.on('error', () => {}).end(input);
  on_start?.(child);
  return new Promise((done, fail) => {
    const late = setTimeout(() => child.kill('SIGKILL'), timeout_ms * slowness);
    child.on('error', fail);
    child.on('close', (status, signal) => {
      clearTimeout(late);
      alive.delete(child);
      const bytes = Buffer.concat(out), stdout = bytes.toString(), stderr = Buffer.concat(err).toString();
      done({ status, signal, bytes, stdout, stderr, ms: Date.now() - from, lines: () => stdout.split('\n').filter(Boolean).map((line) => JSON.parse(line)) });
    });
  });
}

/** groomctl against a daemon. */
export function groomctl(daemon, args, options = {}) {
  return run(join(build, 'groomctl'), args, { ...options, env: { GROOM_SERVER: daemon?.url ?? 'http://127.0.0.1:9', ...options.env } });
}

/** groom-worker by itself: what parses untrusted bytes. */
export function worker(args, options = {}) {
  return run(join(build, 'groom-worker'), args, options);
}
