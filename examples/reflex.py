"""A slip reflex next to your own arm program: the program moves the arm, lsds keeps the grip. Figures are simulated.

On hardware lsds does not know the arm (`[arm] backend = "none"`), and the grip runs in the background:
`with engine.background() as grip: grip.wait_for("hold"); ...; job.let_go()`. The simulated cell has a virtual clock
that this loop steps, so the arm program is the body of the loop.
"""

import lsds
from lsds.contracts import ArmCommand

job = lsds.HoldJob()
with lsds.bring_up(overrides=["task.grip_aperture_m=0.0234"], job=job) as engine:
    arm, clock = engine.rig.arm, engine.rig.clock
    begun_s = None
    for cycle in engine:
        if cycle.stage != "hold":
            continue
        now_s = clock.now() / 1e9
        begun_s = begun_s or now_s
        if now_s < begun_s + 2.0:
            up = lsds.Twist(linear_m_s=(0.0, 0.0, 0.03))
            arm.command(ArmCommand(up, acceleration_m_s2=0.5, expires_ns=clock.now() + 100_000_000))
        elif now_s > begun_s + 2.5:
            job.let_go()
        if cycle.command_m is not None:
            print(f"{now_s - begun_s:.2f} s: slip, the grip closes to {1e3 * cycle.command_m:.2f} mm")
print("released" if engine.released else "still held")
