"""What a sweep costs on a Dask cluster: seconds and bytes a launch, and the overhead of a task.

    python benchmarks/cluster.py

A local cluster of one worker process answers jobs of few and of many launches. From these, the time is estimated that
10**12 half periods take on 100 machines of 16 cores (docs/howto/sweeps.md).
"""

from time import perf_counter

import numpy as np
from distributed import Client, LocalCluster

import generated.pendulum as pendulum
from gqm_sym.runtime.sweep import cluster

FEW, MANY, JOBS = 100, 10**6, 20
LAUNCHES, MACHINES, CORES = 10**12, 100, 16


def seconds(client: Client, count: int) -> float:
    """Return the least time of some sweeps of JOBS jobs with so many launches each."""
    cluster.LAUNCHES_PER_JOB = count
    lam0 = np.random.default_rng(0).uniform(-1.5, 0.9, count * JOBS)
    pendulum.sweep("half_period", lam0[:count], client=client)
    times = []
    for _ in range(3):
        begin = perf_counter()
        swept = pendulum.sweep("half_period", lam0, client=client)
        times.append(perf_counter() - begin)
    assert not swept.status.any()
    return min(times)


def main() -> None:
    """Measure and print."""
    with LocalCluster(n_workers=1, threads_per_worker=1, dashboard_address=None) as local, Client(local) as client:
        task = seconds(client, FEW) / JOBS
        each = (seconds(client, MANY) / JOBS - task) / MANY
    lam0 = np.random.default_rng(0).uniform(-1.5, 0.9, MANY)
    alone = []
    for _ in range(5):
        begin = perf_counter()
        swept = pendulum.sweep("half_period", lam0)
        alone.append(perf_counter() - begin)
    size = sum(field.nbytes for field in swept) / MANY
    print(f"overhead of a task: {1e3 * task:.1f} ms")
    print(f"a launch on a cluster, with its data sent there and back: {1e9 * each:.0f} ns")
    print(f"a launch alone: {1e9 * min(alone) / MANY:.0f} ns")
    print(f"a launch sent: 8 bytes; its answer: {size:.0f} bytes")
    tasks = LAUNCHES / MANY
    print(f"10**12 launches: {tasks:.0e} tasks, which one scheduler hands out in {tasks * task / 3600:.1f} h;")
    print(f"  on {MACHINES * CORES} cores {LAUNCHES * each / (MACHINES * CORES) / 60:.1f} min of work;")
    print(f"  {LAUNCHES * size / 1e12:.0f} TB of answers through one process")


if __name__ == "__main__":
    main()
