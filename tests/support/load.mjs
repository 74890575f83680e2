// A thousand connections at once, and how long a job's status takes meanwhile. The clock runs in a process
// of its own, which does nothing else.
//
//   const { p50_ms, p99_ms, max_ms, rss_mb } = await underLoad(daemon, { streams: 500, slow: 100, idle: 400, seconds: 10, job });
import { fork } from 'node:child_process';
import { readFileSync, readdirSync } from 'node:fs';
import net from 'node:net';
import { performance } from 'node:perf_hooks';
import { fileURLToPath } from 'node:url';

const self = fileURLToPath(import.meta.url);

/** The child: one keep-alive connection, one request every few milliseconds. Sorted milliseconds. */
function clock(port, path, seconds, every_ms) {
  const request = `GET ${path} HTTP/1.1\r\nHost: localhost\r\n\r\n`, times = [], end = performance.now() + seconds * 1000;
  return new Promise((done, fail) => {
    let sent = 0, text = '';
    const socket = net.connect(port, '127.0.0.1').setNoDelay(true);
    const ask = () => { text = ''; sent = performance.now(); socket.write(request); };
    socket.on('connect', ask).on('error', fail).on('data', (piece) => {
      text += piece.toString('latin1');
      const head = text.indexOf('\r\n\r\n'), length = Number(/content-length: (\d+)/i.exec(text)?.[1]);
      if (head < 0 || text.length < head + 4 + length) return;
      if (!text.startsWith('HTTP/1.1 200')) { fail(new Error(text.slice(0, 300))); return; }
      times.push(performance.now() - sent);
      if (performance.now() < end) setTimeout(ask, every_ms);
      else { socket.destroy(); done(times.sort((a, b) => a - b)); }
    });
  });
}

/** A process that does nothing but answer: what the machine itself makes of a question, with the same load. */
function echo() {
  const server = net.createServer((socket) => socket.setNoDelay(true).on('error', () => {}).on('data', () => socket.write('HTTP/1.1 200 OK\r\nContent-Length: 2\r\n\r\nok')));
  server.listen(0, '127.0.0.1', () => process.send(server.address().port));
}

const message_of = (child) => new Promise((done, fail) => { child.on('message', done); child.on('exit', (code) => { if (code) fail(new Error(`a process of the measurement ended with ${code}`)); }); });
const start = (...args) => fork(self, args.map(String), { stdio: ['ignore', 'ignore', 'inherit', 'ipc'] });

export const status_of = (pid, name) => Number(new RegExp(`^${name}:\\s+(\\d+)`, 'm').exec(readFileSync(`/proc/${pid}/status`, 'utf8'))?.[1]);
export const descriptors_of = (pid) => readdirSync(`/proc/${pid}/fd`).length;

export async function underLoad(daemon, { streams, slow, idle, seconds, job, every_ms = 5 }) {
  const port = Number(new URL(daemon.url).port), sockets = new Set(), timers = new Set();
  let open = true, n_events = 0, n_cut = 0;
  const connect = (text, again) => new Promise((done) => {
    const socket = net.connect(port, '127.0.0.1', () => { socket.write(text); done(socket); });
    sockets.add(socket);
    socket.on('data', (piece) => { n_events += piece.length; }).on('error', () => {}).on('close', () => {
      sockets.delete(socket);
      if (open) { n_cut++; if (again) again(); }
    });
  });
  const stream = () => connect(`GET /v1/jobs/${job}/events HTTP/1.1\r\nHost: localhost\r\n\r\n`, stream);
  const slowly = async () => { // a byte a second; who is cut for it comes again
    const socket = await connect('POST /v1/strands HTTP/1.1\r\nHost: localhost\r\nContent-Length: 100000\r\n\r\n', slowly);
    const timer = setInterval(() => { if (socket.destroyed) { clearInterval(timer); timers.delete(timer); } else socket.write('H'); }, 1000);
    timers.add(timer);
  };
  const wait = () => connect('GET /healthz HTTP/1.1\r\nHost: localhost\r\n\r\n', wait);
  for (const [n, make] of [[streams, stream], [slow, slowly], [idle, wait]]) for (let i = 0; i < n; i += 50) await Promise.all(Array.from({ length: Math.min(50, n - i) }, make));
  const n_open = sockets.size;
  const echoes = start('echo'), echo_port = await message_of(echoes);
  const times = await message_of(start('clock', port, `/v1/jobs/${job}`, seconds, every_ms));
  const machine = await message_of(start('clock', echo_port, '/', seconds / 2, every_ms));
  echoes.kill('SIGKILL');
  const rss_mb = status_of(daemon.child.pid, 'VmRSS') / 1024, peak_mb = status_of(daemon.child.pid, 'VmHWM') / 1024, n_fd = descriptors_of(daemon.child.pid);
  open = false;
  for (const timer of timers) clearInterval(timer);
  for (const socket of sockets) socket.destroy();
  const at = (share, of = times) => of[Math.min(of.length - 1, Math.floor(share * of.length))];
  return { n: times.length, n_open, n_cut, n_events, n_fd, p50_ms: at(0.5), p99_ms: at(0.99), machine_p99_ms: at(0.99, machine), max_ms: times.at(-1), rss_mb, peak_mb };
}

if (process.argv[1] === self && process.argv[2] === 'echo') echo();
if (process.argv[1] === self && process.argv[2] === 'clock') {
  const [port, path, seconds, every_ms] = process.argv.slice(3);
  process.send(await clock(Number(port), path, Number(seconds), Number(every_ms)));
  process.disconnect();
}
