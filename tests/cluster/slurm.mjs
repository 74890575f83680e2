// A Slurm cluster of one controller and two nodes on loopback: everything in a folder of its own, on ports
// of its own, with a key of its own. It is started and stopped by process id and touches no other Slurm.
//
//   const cluster = await startCluster(t);      // cluster.env names its configuration for Slurm's programs
//   await cluster.kill('d1');                   // the node is gone, with everything that ran on it
import { spawn, execFileSync } from 'node:child_process';
import { randomBytes } from 'node:crypto';
import { chmodSync, existsSync, mkdirSync, mkdtempSync, openSync, closeSync, readFileSync, readdirSync, rmSync, writeFileSync } from 'node:fs';
import net from 'node:net';
import { hostname, tmpdir, userInfo } from 'node:os';
import { join } from 'node:path';
import { until } from '../support/daemon.mjs';

const sbin = { ...process.env, PATH: `${process.env.PATH}:/usr/sbin:/sbin` };

function freePorts(n) {
  const servers = Array.from({ length: n }, () => net.createServer());
  return Promise.all(servers.map((server) => new Promise((done) => server.listen(0, '127.0.0.1', () => done(server.address().port)))))
    .then(async (ports) => { await Promise.all(servers.map((server) => new Promise((done) => server.close(done)))); return ports; });
}

// cred_expire: how long Slurm waits before it starts a job again; SlurmdTimeout: until a node counts as down
const configuration = (folder, [controller, d1, d2], host, user) => `ClusterName=groomtest
SlurmctldHost=${host}(127.0.0.1)
SlurmctldPort=${controller}
SlurmUser=${user}
SlurmdUser=${user}
AuthType=auth/munge
AuthInfo=socket=${folder}/munge/socket,cred_expire=5
CredType=cred/munge
SlurmctldPidFile=${folder}/slurmctld.pid
SlurmdPidFile=${folder}/slurmd.%n.pid
SlurmdSpoolDir=${folder}/spool.%n
StateSaveLocation=${folder}/state
SlurmctldLogFile=${folder}/slurmctld.log
SlurmdLogFile=${folder}/slurmd.%n.log
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
SelectType=select/cons_tres
SelectTypeParameters=CR_CPU_Memory
SwitchType=switch/none
MpiDefault=none
JobAcctGatherType=jobacct_gather/none
AccountingStorageType=accounting_storage/none
JobCompType=jobcomp/none
ReturnToService=2
SlurmctldTimeout=30
SlurmdTimeout=5
KillWait=5
MinJobAge=30
NodeName=d1 NodeHostname=${host} NodeAddr=127.0.0.1 Port=${d1} CPUs=1 RealMemory=4000
NodeName=d2 NodeHostname=${host} NodeAddr=127.0.0.1 Port=${d2} CPUs=1 RealMemory=4000
PartitionName=main Nodes=d1,d2 Default=YES MaxTime=120 State=UP
`;

/** Process ids of everything below these. */
function descendants(pids) {
  const found = [];
  for (const pid of pids) {
    try {
      const children = readdirSync(`/proc/${pid}/task`).flatMap((task) => readFileSync(`/proc/${pid}/task/${task}/children`, 'utf8').split(' ').filter(Boolean).map(Number));
      found.push(pid, ...descendants(children));
    } catch { /* it has ended */ }
  }
  return found;
}

/** slurmstepd names itself after the job it looks after. */
function keepersOf(job) {
  return readdirSync('/proc').filter((name) => /^[0-9]+$/.test(name)).map(Number).filter((pid) => {
    try { return readFileSync(`/proc/${pid}/cmdline`, 'latin1').startsWith(`slurmstepd: [${job}.batch]`); } catch { return false; }
  });
}

class Cluster {
  constructor(folder, ports) {
    Object.assign(this, { folder, ports, children: new Map() });
    this.env = { ...sbin, SLURM_CONF: join(folder, 'slurm.conf') };
  }

  start(name, program, args) {
    const log = openSync(join(this.folder, `${name}.out`), 'a');
    const child = spawn(program, args, { stdio: ['ignore', log, log], env: this.env });
    closeSync(log);
    child.ended = new Promise((done) => child.on('exit', done));
    child.on('error', () => {});
    this.children.set(name, child);
  }

  startNode(name) { this.start(name, 'slurmd', ['-D', '-N', name, '-f', this.env.SLURM_CONF]); }

  run(program, args) { return execFileSync(program, args, { env: this.env, encoding: 'utf8' }); }

  /** [{ name, id, state, node }] of what squeue knows. */
  jobs() {
    return this.run('squeue', ['--noheader', '--states=all', '--Format=Name:|,JobID:|,State:|,BatchHost:|,RestartCnt:|']).trim().split('\n').filter(Boolean)
      .map((line) => { const [name, id, state, node, restarts] = line.split('|'); return { name, id, state, node, restarts: Number(restarts) }; });
  }

  /** Every process that runs for these jobs. */
  processes(jobs) { return jobs.flatMap(({ id }) => descendants(keepersOf(id))); }

  async kill(node) {
    const on_node = this.jobs().filter((job) => job.node === node && job.state === 'RUNNING');
    const child = this.children.get(node);
    const pids = this.processes(on_node);
    child.kill('SIGKILL');
    for (const pid of pids) { try { process.kill(pid, 'SIGKILL'); } catch { /* it was quicker */ } }
    await child.ended;
  }

  logs() {
    return readdirSync(this.folder).filter((name) => /\.(log|out)$/.test(name)).map((name) => `--- ${name}\n${readFileSync(join(this.folder, name), 'utf8').slice(-2000)}`).join('\n');
  }

  async stop() {
    try {
      this.run('scancel', ['--quiet', '--signal=KILL', '--full', '--me']);
      this.run('scancel', ['--quiet', '--me']);
      await until('the cluster is empty', () => this.processes(this.jobs()).length === 0, 15000);
    } catch { /* the processes are ended below */ }
    for (const name of ['d1', 'd2', 'controller', 'munge']) {
      const child = this.children.get(name);
      if (!child || child.exitCode !== null || child.signalCode !== null) continue;
      child.kill('SIGTERM');
      const late = setTimeout(() => child.kill('SIGKILL'), 10000);
      await child.ended;
      clearTimeout(late);
    }
    rmSync(this.folder, { recursive: true, force: true });
  }
}

export async function startCluster(t) {
  const folder = mkdtempSync(join(tmpdir(), 'groom-slurm-'));
  const cluster = new Cluster(folder, await freePorts(3));
  t.after(() => cluster.stop());
  const host = hostname().split('.')[0], user = userInfo().username;
  for (const name of ['munge', 'state', 'spool.d1', 'spool.d2']) mkdirSync(join(folder, name));
  writeFileSync(join(folder, 'munge.key'), randomBytes(128), { mode: 0o600 });
  writeFileSync(cluster.env.SLURM_CONF, configuration(folder, cluster.ports, host, user));
  chmodSync(join(folder, 'munge'), 0o755);
  const munge = (what) => join(folder, 'munge', what);
  cluster.start('munge', 'munged', ['--foreground', '--force', '--key-file', join(folder, 'munge.key'), '--socket', munge('socket'), '--pid-file', munge('pid'), '--log-file', munge('log'), '--seed-file', munge('seed')]);
  await until('munged has its socket', () => existsSync(munge('socket')));
  cluster.start('controller', 'slurmctld', ['-D', '-f', cluster.env.SLURM_CONF]);
  cluster.startNode('d1');
  cluster.startNode('d2');
  try {
    await until('both nodes are idle', () => {
      try { return cluster.run('sinfo', ['--noheader', '--Node', '--format=%N %T']).trim() === 'd1 idle\nd2 idle'; } catch { return false; }
    }, 60000);
  } catch (error) {
    throw new Error(`${error.message}\n${cluster.logs()}`);
  }
  return cluster;
}
