#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""A Slurm cluster of one node, this machine: munged, slurmctld and slurmd of Debian's slurm-wlm, all state in one folder, on loopback.

    slurm_node.py FOLDER [CPUS]     starts it, prints SLURM_CONF=..., and stops it at the end of its input

It needs neither cgroups nor a database: processes are tracked by linuxproc and bound to a job's cores by task/affinity, and a job that takes
more memory than it asked for is killed by slurmd, which looks every second.
"""
import os
import pathlib
import shutil
import socket
import subprocess
import sys
import time

PROGRAMS = ("munged", "slurmctld", "slurmd", "sbatch", "scontrol", "scancel")


def missing():
    """Programs of slurm-wlm and munge that are not installed."""
    return [name for name in PROGRAMS if not find(name)]


def find(name):
    return shutil.which(name, path=os.environ["PATH"] + ":/usr/sbin:/sbin")


def free_ports(count):
    held = [socket.socket() for _ in range(count)]
    for one in held:
        one.bind(("127.0.0.1", 0))
    ports = [one.getsockname()[1] for one in held]
    for one in held:
        one.close()
    return ports


class SlurmNode:
    def __init__(self, folder, cpus=2):
        self.folder = pathlib.Path(folder).resolve()
        self.cpus, self.processes = cpus, []
        self.conf = self.folder / "slurm.conf"
        self.env = {**os.environ, "SLURM_CONF": str(self.conf)}

    def __enter__(self):
        for name in ("state", "spool"):
            (self.folder / name).mkdir(parents=True, exist_ok=True)
        self.folder.chmod(0o755)  # munged asks for it
        key = self.folder / "munge.key"
        key.write_bytes(os.urandom(1024))
        key.chmod(0o600)
        self.write_conf()
        try:
            self.start("munged", "--foreground", "--force", f"--socket={self.folder}/munge.socket", f"--key-file={key}",
                       f"--pid-file={self.folder}/munged.pid", f"--log-file={self.folder}/munged.log", f"--seed-file={self.folder}/munged.seed")
            self.wait(lambda: (self.folder / "munge.socket").exists(), "munged")
            self.start("slurmctld", "-D")
            self.start("slurmd", "-D", "-N", self.host)
            self.wait(lambda: "idle" in self.ask("sinfo", "--noheader", "--format=%T"), "slurmd")
        except BaseException:
            self.__exit__()
            raise
        return self

    def __exit__(self, *_):
        for process in reversed(self.processes):
            process.terminate()
        for process in reversed(self.processes):
            try:
                process.wait(20)
            except subprocess.TimeoutExpired:
                process.kill()
                process.wait()

    def write_conf(self):
        self.host = socket.gethostname().split(".")[0]
        user = subprocess.run(["id", "-un"], stdout=subprocess.PIPE, text=True, check=True).stdout.strip()
        control, node = free_ports(2)
        memory = pathlib.Path("/proc/meminfo").read_text().splitlines()[0]
        mib = int(memory.split()[1]) // 1024 * 3 // 4
        self.conf.write_text(f"""ClusterName=ecorche
SlurmctldHost={self.host}(127.0.0.1)
CommunicationParameters=NoInAddrAny,NoCtldInAddrAny
AuthType=auth/munge
AuthInfo=socket={self.folder}/munge.socket
CredType=cred/munge
SlurmUser={user}
SlurmdUser={user}
SlurmctldPort={control}
SlurmdPort={node}
StateSaveLocation={self.folder}/state
SlurmdSpoolDir={self.folder}/spool
SlurmctldPidFile={self.folder}/slurmctld.pid
SlurmdPidFile={self.folder}/slurmd.pid
ProctrackType=proctrack/linuxproc
TaskPlugin=task/affinity
JobAcctGatherType=jobacct_gather/linux
JobAcctGatherFrequency=1
JobAcctGatherParams=OverMemoryKill
SelectType=select/cons_tres
SelectTypeParameters=CR_CPU_Memory
SchedulerParameters=batch_sched_delay=0,sched_min_interval=100000
ReturnToService=2
KillWait=3
MailProg=/bin/true
NodeName={self.host} NodeAddr=127.0.0.1 CPUs={self.cpus} RealMemory={mib} State=UNKNOWN
PartitionName=main Nodes={self.host} Default=YES MaxTime=INFINITE State=UP
""")

    def start(self, name, *words):
        with open(self.folder / f"{name}.out", "w") as log:
            self.processes.append(subprocess.Popen([find(name), *map(str, words)], stdin=subprocess.DEVNULL, stdout=log, stderr=log, env=self.env,
                                                   start_new_session=True))

    def wait(self, ready, what, seconds=30):
        end = time.monotonic() + seconds
        while not ready():
            dead = next((process for process in self.processes if process.poll() is not None), None)
            if dead or time.monotonic() > end:
                said = (self.folder / f"{pathlib.Path(dead.args[0]).name if dead else what}.out").read_text()[-2000:]
                raise RuntimeError(f"{what} does not come up: {said}")
            time.sleep(0.1)

    def ask(self, *words):
        done = subprocess.run(list(map(str, words)), stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, env=self.env, timeout=60)
        return done.stdout if done.returncode == 0 else ""

    def jobs(self):
        """{id: {field: value}} of all that the controller remembers."""
        found = {}
        for line in self.ask("scontrol", "--oneliner", "show", "job").splitlines():
            fields = dict(word.split("=", 1) for word in line.split() if "=" in word)
            if "JobId" in fields:
                found[fields["JobId"]] = fields
        return found


if __name__ == "__main__":
    with SlurmNode(sys.argv[1], int(sys.argv[2]) if len(sys.argv) > 2 else 2) as node:
        print(f"SLURM_CONF={node.conf}", flush=True)
        sys.stdin.read()
