// What deploy/ promises (make test-deploy): nginx in front of a daemon, the Debian package, the systemd
// unit, and as much of the container files as can be read without an engine.
import assert from 'node:assert/strict';
import { spawn, spawnSync } from 'node:child_process';
import { existsSync, readFileSync, writeFileSync } from 'node:fs';
import net from 'node:net';
import { dirname, join, resolve } from 'node:path';
import { fileURLToPath } from 'node:url';
import { test } from 'node:test';
import YAML from 'yaml';

import { startIdleDaemon, submit, call } from '../support/api.mjs';
import { build, run, temporaryFolder, until } from '../support/daemon.mjs';
import { straightHair } from '../support/strands.mjs';

const top = resolve(dirname(fileURLToPath(import.meta.url)), '../..');
const env = { ...process.env, PATH: `${process.env.PATH}:/usr/sbin:/sbin` };
const has = (program) => spawnSync('sh', ['-c', `command -v ${program}`], { env }).status === 0;
const free = () => new Promise((done) => { const server = net.createServer().listen(0, '127.0.0.1', () => { const { port } = server.address(); server.close(() => done(port)); }); });

/** deploy/nginx/groomd.conf with ports and paths of this test, run by nginx itself: its https address. */
async function startNginx(t, daemon) {
  const folder = temporaryFolder(t), plain = await free(), secure = await free();
  assert.equal((await run('openssl', ['req', '-x509', '-newkey', 'rsa:2048', '-nodes', '-days', '2', '-subj', '/CN=grooms.example.org', '-keyout', join(folder, 'key.pem'), '-out', join(folder, 'cert.pem')])).status, 0);
  const site = readFileSync(join(top, 'deploy/nginx/groomd.conf'), 'utf8')
    .replaceAll('/etc/ssl/groomd', folder).replace('127.0.0.1:8080', new URL(daemon.url).host)
    .replaceAll(/listen \[::\]:.*\n/g, '').replace('listen 80;', `listen 127.0.0.1:${plain};`).replace('listen 443', `listen 127.0.0.1:${secure}`);
  writeFileSync(join(folder, 'site.conf'), site);
  const temp = ['client_body', 'proxy', 'fastcgi', 'uwsgi', 'scgi'].map((name) => `${name}_temp_path ${folder}/${name};`).join(' ');
  writeFileSync(join(folder, 'nginx.conf'), `daemon off; pid ${folder}/pid; error_log ${folder}/error.log; ${process.getuid() === 0 ? 'user root;' : ''}\nevents {}\nhttp { access_log off; ${temp} include ${folder}/site.conf; }\n`);
  const args = ['-c', join(folder, 'nginx.conf'), '-e', join(folder, 'error.log')];
  const check = await run('nginx', ['-t', ...args], { env });
  assert.equal(check.status, 0, check.stderr);
  assert.doesNotMatch(check.stderr, /warn/);
  const child = spawn('nginx', args, { env, stdio: 'ignore' });
  const ended = new Promise((done) => child.on('exit', done));
  t.after(async () => { child.kill('SIGTERM'); await ended; });
  const connects = () => new Promise((done) => { const socket = net.connect(secure, '127.0.0.1', () => { socket.destroy(); done(true); }).on('error', () => done(false)); });
  await until('nginx listens', connects);
  return { secure, plain };
}

const curl = (secure, args, options) => run('curl', ['--silent', '--insecure', '--max-time', '60', '--resolve', `grooms.example.org:${secure}:127.0.0.1`, ...args], options);

test('nginx in front: TLS, HTTP/2, a large upload, an event stream as it comes', { skip: !has('nginx') && 'nginx is not installed' }, async (t) => {
  const daemon = await startIdleDaemon(t, { args: ['--hosts', 'grooms.example.org'] });
  const { secure, plain } = await startNginx(t, daemon), at = `https://grooms.example.org:${secure}`;
  // what a proxy passes on comes from elsewhere: without tokens it is refused
  assert.match((await curl(secure, [`${at}/v1/jobs`])).stdout, /groomd token create/);
  const made = await run(join(build, 'groomd'), ['token', 'create', '--data', daemon.data, '--name', 'nginx', '--scopes', 'read,submit,admin']);
  daemon.token = made.stdout.trim();
  const auth = ['--header', `Authorization: Bearer ${daemon.token}`];

  const health = await curl(secure, ['--http2', '--write-out', '%{http_version} %{http_code}', `${at}/healthz`]);
  assert.equal(health.stdout, '{"status":"ok"}2 200', health.stderr);
  const moved = await run('curl', ['--silent', '--output', '/dev/null', '--write-out', '%{http_code} %{redirect_url}', '--header', 'Host: grooms.example.org', `http://127.0.0.1:${plain}/v1/jobs?limit=2`]);
  assert.equal(moved.stdout, '301 https://grooms.example.org/v1/jobs?limit=2');
  for (const [path, status] of [['/v1/work/job', '404'], ['/metrics', '200']])
    assert.equal((await curl(secure, [...auth, '--output', '/dev/null', '--write-out', '%{http_code}', at + path])).stdout, status, path);

  await t.test('an upload of 72 MB goes through and is stored once', async () => {
    const folder = temporaryFolder(t), file = join(folder, 'large.hair');
    writeFileSync(file, straightHair(60000, 100));
    for (const version of ['--http2', '--http1.1']) {
      const sent = await curl(secure, [...auth, version, '--data-binary', `@${file}`, '--header', 'Content-Type: application/octet-stream', `${at}/v1/strands`]);
      assert.equal(JSON.parse(sent.stdout).vertices, 6000000, sent.stdout + sent.stderr);
    }
  });

  await t.test('events arrive one by one', async () => {
    const job = await submit(daemon), token = await daemon.attempt();
    let text = '';
    const watch = curl(secure, [...auth, '--http2', '--no-buffer', `${at}/v1/jobs/${job.id}/events`], { on_start: (child) => child.stdout.on('data', (piece) => { text += piece; }) });
    await until('the first event is there', () => /"state":"running"/.test(text));
    for (const progress of [0.25, 0.5]) {
      await call(daemon, 'POST', '/v1/work/progress', { token, body: { progress } });
      await until('the next event is there while the stream is open', () => text.includes(`"progress":${progress}`), 5000);
    }
    await call(daemon, 'POST', '/v1/work/failed', { token, body: { type: '/problems/empty', title: 'x', status: 422, detail: 'x' } });
    assert.match((await watch).stdout, /"state":"failed"/);
  });
});

test('the Debian package has what it needs and runs from where it is unpacked', { skip: !has('dpkg-shlibdeps') && 'dpkg-dev is not installed' }, async (t) => {
  const folder = temporaryFolder(t), root = join(folder, 'root');
  const made = await run(join(top, 'deploy/debian/build.sh'), [folder], { env: { BUILD: build } });
  assert.equal(made.status, 0, made.stderr);
  const deb = made.stdout.trim();
  const control = (await run('dpkg-deb', ['--field', deb])).stdout;
  for (const library of ['libmicrohttpd12', 'libsqlite3-0', 'libembree3-3', 'libcurl4']) assert.ok(control.includes(library), control);
  assert.doesNotMatch((await run('dpkg-deb', ['--contents', deb])).stdout, /node_modules|\/work\/|\.o\n/);
  assert.equal((await run('dpkg-deb', ['--extract', deb, root])).status, 0);
  assert.equal((await run('dpkg-deb', ['--control', deb, join(folder, 'control')])).status, 0);
  for (const script of ['postinst', 'prerm', 'postrm']) assert.equal((await run('sh', ['-n', join(folder, 'control', script)])).status, 0, script);

  // its configuration file, with a folder and a port of this test
  const config = join(root, 'etc/groomd/groomd.conf');
  writeFileSync(config, readFileSync(config, 'utf8').replace('/var/lib/groomd', join(folder, 'var')).replace(':8080', ':0'));
  const child = spawn(join(root, 'usr/bin/groomd'), ['--config', config], { stdio: ['ignore', 'pipe', 'ignore'], env: {} });
  const ended = new Promise((done) => child.on('exit', done));
  t.after(() => child.kill('SIGKILL'));
  let out = '';
  child.stdout.on('data', (piece) => { out += piece; });
  const url = await until('it listens', () => /listening on (\S+)/.exec(out)?.[1]);
  const groomctl = (args) => run(join(root, 'usr/bin/groomctl'), args, { env: { GROOM_SERVER: url } });
  assert.equal((await groomctl(['sample', '--strands', '300', '-o', join(folder, 'sample')])).status, 0);
  const fit = await groomctl(['fit', join(folder, 'sample/strands.hair'), '--guides', '10', '--operator-guides', '10', '-o', join(folder, 'out.hair')]);
  assert.equal(fit.status, 0, fit.stderr);
  child.kill('SIGTERM');
  assert.equal(await ended, 0);

  await t.test('the unit is one, and hardened', { skip: !has('systemd-analyze') && 'systemd-analyze is not installed' }, async () => {
    const verify = await run('systemd-analyze', ['verify', `--root=${root}`, 'groomd.service']);
    // the root has no other units: that they are missing is all that may be said
    const said = verify.stderr.split('\n').filter((line) => line && !/sysinit\.target not found|Failed to create groomd\.service\/start/.test(line));
    assert.deepEqual(said, []);
    const security = await run('systemd-analyze', ['security', '--offline=true', `--root=${root}`, '--threshold=20', 'groomd.service']);
    assert.equal(security.status, 0, security.stdout.slice(-200));
    t.diagnostic(security.stdout.trim().split('\n').at(-1));
  });
});

test('the container files name what is there', () => {
  const text = readFileSync(join(top, 'deploy/container/Containerfile'), 'utf8').replaceAll('\\\n', ' ');
  const words = new Set(['FROM', 'WORKDIR', 'COPY', 'RUN', 'USER', 'VOLUME', 'ENV', 'STOPSIGNAL', 'HEALTHCHECK', 'ENTRYPOINT']);
  for (const line of text.split('\n').filter((line) => line.trim() && !line.startsWith('#'))) {
    const [word, ...rest] = line.trim().split(/\s+/);
    assert.ok(words.has(word), line);
    if (word === 'COPY' && !rest[0].startsWith('--')) for (const source of rest.slice(0, -1)) assert.ok(existsSync(join(top, source)), source);
    if (word === 'RUN') assert.equal(spawnSync('sh', ['-n', '-c', rest.join(' ')]).status, 0, line);
  }
  // the studio is bundled by node, which packages.txt does not name: any will do (setup.sh)
  assert.match(text, /apt-get install .*\bnodejs npm ca-certificates\b/);
  // what is built here, for this machine, stays out of the image
  assert.deepEqual(readFileSync(join(top, '.dockerignore'), 'utf8').split('\n').filter((line) => line && !line.startsWith('#')), ['build', '**/node_modules', '.git']);
  const list = spawnSync('sed', ['-n', text.match(/sed -n '([^']*)'/)[1], join(top, 'deploy/packages.txt')], { encoding: 'utf8' }).stdout.trim().split('\n');
  for (const name of ['build-essential', 'libmicrohttpd-dev', 'zlib1g-dev']) assert.ok(list.includes(name), `${name} is not in ${list}`);
  const compose = YAML.parse(readFileSync(join(top, 'deploy/container/compose.yaml'), 'utf8')), folder = join(top, 'deploy/container');
  assert.deepEqual(Object.keys(compose.services).sort(), ['groomd', 'nginx']);
  assert.ok(existsSync(join(folder, compose.services.groomd.build.context, compose.services.groomd.build.dockerfile)));
  assert.ok(existsSync(join(folder, compose.services.nginx.volumes[0].split(':')[0])));
});
