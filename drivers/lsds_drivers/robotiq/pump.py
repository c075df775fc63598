"""The I/O thread: polls the status, sends the newest command, reopens a lost port.

Only this thread uses the transport. Callers submit one order at a time, which replaces a pending one, and read the
newest status; neither waits for a request.
"""

from __future__ import annotations

import sys
import threading
from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

from lsds.clock import Clock, nanoseconds, seconds
from lsds.errors import ConnectFailed, DeviceError, DeviceTimeout, ProtocolFault
from lsds_drivers.robotiq.fault_codes import RELEASING, blocks
from lsds_drivers.robotiq.registers import ACTIVATE, Activation, Motion, Status
from lsds_drivers.robotiq.sign_of_life import SignOfLife
from lsds_drivers.robotiq.transport import Transport

SPACING_NS = 5_000_000
"""Minimum time between requests (ns): the refresh period of the registers (200 Hz)."""
BACK_OFF_NS = (50_000_000, 1_000_000_000)
"""First and longest pause between attempts to open the port."""
TRUSTED_NS = 250_000_000
"""Maximum time since the arrival of the status on which a write may rely."""
OLDEST_TRUSTED_NS = 500_000_000
"""Maximum age of that status (ns), however late it arrived; chosen. A gripper that has been switched off and on since
would take a request to activate as one to open."""


class Sample(NamedTuple):
    """A status, the time (ns) at which the gripper had it, and its number."""

    t_ns: int
    seq: int
    status: Status


@dataclass(frozen=True, slots=True)
class Order:
    """An order to write. `expires_ns` is None for the steps of arming, which wait for their execution."""

    action: int
    motion: Motion | None
    expires_ns: int | None = None


@dataclass(slots=True)
class Counts:
    """Counts of requests and orders since connecting."""

    requests: int = 0
    timeouts: int = 0
    damaged: int = 0
    reconnects: int = 0
    sent: int = 0
    replaced: int = 0
    expired: int = 0
    refused: int = 0


class Pump:
    """Owns a transport from `start` to `end`."""

    def __init__(
        self,
        device: str,
        transport: Transport,
        clock: Clock,
        *,
        poll_hz: float,
        open_s: float,
        silence_s: float,
        life_check_s: float = 0.0,
    ):
        self._device = device
        self._transport = transport
        self._clock = clock
        self._period_ns = nanoseconds(1 / poll_hz)
        self._open_s = open_s
        self._silence_ns = nanoseconds(silence_s)
        self._wake = threading.Condition()
        self._thread: threading.Thread | None = None
        self._ending = False
        self._order: Order | None = None
        self._last_sent: Order | None = None
        self._halts_wanted = self._halts_done = 0
        self._newest: Sample | None = None
        self._error: DeviceError | None = None
        self._doubtful = False
        self._fastest_ns = sys.maxsize
        self._last_ns = self._good_ns = self._polled_ns = self._looked_ns = 0
        self._sent: tuple[int, Motion] | None = None
        self._unechoed_ns: int | None = None
        self._certain = False
        self._life = SignOfLife(nanoseconds(life_check_s))
        self.counts = Counts()

    @property
    def newest(self) -> Sample | None:
        """The newest status; None before the first."""
        return self._newest

    @property
    def error(self) -> DeviceError | None:
        """The error of the last request; None on success."""
        return self._error

    @property
    def unechoed_ns(self) -> int | None:
        """Time (ns) of the first acknowledged request missing in the status; None if it shows the last one."""
        return self._unechoed_ns if self._unechoed_ns is not None else self._life.unanswered_ns

    @property
    def moving_since_ns(self) -> int | None:
        """Time (ns) of the last change of a status that reports motion; None if the newest one reports none."""
        return self._life.moving_since_ns

    @property
    def halts(self) -> int:
        """Number of requests to end motion."""
        return self._halts_wanted

    def open(self, timeout_s: float) -> None:
        """Open the transport, get a first status, start the thread. On ConnectFailed everything is closed again."""
        try:
            self._first_status(self._clock.now() + nanoseconds(timeout_s))
        except BaseException:
            self._transport.close()
            raise
        self._thread = threading.Thread(target=self._run, name=f"lsds {self._device}", daemon=True)
        self._thread.start()

    def post(self, order: Order) -> None:
        """Submit an order; it replaces one that was not sent yet."""
        with self._wake:
            if self._order is not None:
                self.counts.replaced += 1
            self._order = order
            self._wake.notify_all()

    def halt(self, timeout_s: float) -> bool:
        """End motion as soon as possible, in place of any pending order; return whether that was done in time.

        A stop that could not be sent in time is sent as soon as the gripper answers again.
        """
        with self._wake:
            if self._thread is None:
                return False
            self._halts_wanted += 1
            wanted = self._halts_wanted
            self._order = None
            self._wake.notify_all()
            self._wake.wait_for(lambda: self._halts_done >= wanted or self._ending, timeout_s)
            return self._halts_done >= wanted

    def wait_for(self, done: Callable[[Status], bool], timeout_s: float, since_ns: int) -> Sample | None:
        """Return the first status newer than a time that is `done`; None if none arrives, or if motion has to end."""
        halts = self._halts_wanted

        def over() -> bool:
            sample = self._newest
            found = sample is not None and sample.t_ns > since_ns and done(sample.status)
            return found or self._halts_wanted != halts or self._ending

        with self._wake:
            self._wake.wait_for(over, timeout_s)
            sample = self._newest
            if sample is not None and sample.t_ns > since_ns and done(sample.status):
                return sample
            return None

    def wait_sent(self, order: Order, timeout_s: float) -> bool:
        """Wait until an order was taken; return whether it was sent. An order that was not sent is withdrawn."""
        with self._wake:
            self._wake.wait_for(lambda: self._order is not order or self._ending, timeout_s)
            if self._order is order:
                self._order = None
            return self._last_sent is order

    def end(self, timeout_s: float) -> None:
        """End the thread, which closes the transport; wait for it."""
        with self._wake:
            self._ending = True
            self._wake.notify_all()
        if self._thread is not None:
            self._thread.join(timeout_s)
        else:
            self._transport.close()

    def _first_status(self, deadline_ns: int) -> None:
        """Open and poll until a status arrives. Raises ConnectFailed at the deadline."""
        opened = False
        while True:
            try:
                if not self._transport.is_open:
                    self._transport.open(max(0.01, seconds(deadline_ns - self._clock.now())))
                    opened = True
                self._poll()
                return
            except ConnectFailed as error:
                # A port that cannot be opened is a final failure; a port that opened and then closed may still have
                # been in use by its previous client.
                if not opened or self._clock.now() >= deadline_ns:
                    raise
                self._failed(error)
            except DeviceError as error:
                if self._clock.now() >= deadline_ns:
                    raise ConnectFailed(self._device, error.problem, remedy=error.remedy, code=error.code) from error
                self._failed(error)
            self._clock.sleep_until(self._clock.now() + 2 * SPACING_NS)

    # -- in the thread ------------------------------------------------------------------------------------

    def _run(self) -> None:
        pause = BACK_OFF_NS[0]
        try:
            while not self._ending:
                try:
                    if not self._transport.is_open:
                        self._transport.open(self._open_s)
                        self.counts.reconnects += 1
                        self._good_ns = self._clock.now()
                    self._turn()
                    pause = BACK_OFF_NS[0]
                except ConnectFailed as error:
                    self._failed(error)
                    self._transport.close()
                    self._pause(pause)
                    pause = min(2 * pause, BACK_OFF_NS[1])
                except DeviceError as error:
                    self._failed(error)
                # An unexpected exception of a library must not end the gripper's thread.
                except Exception as error:
                    self._failed(ProtocolFault(self._device, f"{type(error).__name__}: {error}"))
                    self._transport.close()
        finally:
            self._transport.close()
            with self._wake:
                self._ending = True
                self._wake.notify_all()

    def _turn(self) -> None:
        """Wait until a request is allowed, and make one."""
        with self._wake:
            while not self._ending:
                now = self._clock.now()
                asked = self._order is not None or self._halts_done < self._halts_wanted
                due = self._last_ns + SPACING_NS
                if not (asked or self._life.pending):
                    due = max(due, self._polled_ns + self._period_ns)
                if now >= due:
                    break
                self._wake.wait(seconds(due - now))
            if self._ending:
                return
            halts = self._halts_wanted
            halting = self._halts_done < halts
            # Counted from the last status' arrival: on a slow line every request takes longer than this.
            overdue = self._clock.now() - self._looked_ns > 2 * self._period_ns
            # After a failure, read the status before writing: the gripper may have been switched off and on, and a
            # request to activate would then open it.
            look = self._doubtful or not self._trusted() or (overdue and not halting)
            order = None if halting or look else self._take()
            if order is not None and self._life.defers(order.motion):
                order = None
            idle = not (halting or look) and order is None and self._sent is not None
            test = self._life.request(self._clock.now()) if idle else None
        if look:
            self._poll()
        elif halting:
            self._halt(halts)
        elif order is not None:
            self._send(order)
        elif test is not None:
            self._life.sending(test, self._clock.now())
            self._write(test, None)
        else:
            self._poll()

    def _take(self) -> Order | None:
        """Return the order to send; None without an order, or if it must not be sent any more."""
        order = self._order
        if order is None:
            return None
        if order.expires_ns is not None:
            status = self._newest.status if self._newest is not None else None
            if self._clock.now() >= order.expires_ns:
                self.counts.expired += 1
            elif status is None or status.activation is not Activation.ACTIVE or blocks(status.fault):
                self.counts.refused += 1
            else:
                return order
            self._order = None
            self._wake.notify_all()
            return None
        return order

    def _send(self, order: Order) -> None:
        # The gripper may execute a request whose acknowledgement is lost; the echo then shows either motion.
        self._certain = False
        self._write(order.action, order.motion)
        with self._wake:
            self.counts.sent += 1
            self._certain = True
            self._sent = (self._clock.now(), order.motion) if order.motion is not None else None
            self._await_echo(self._newest)
            self._life.overtaken(order.motion, self._clock.now())
            # An action alone changes the meaning of later writes; read the status before the next one.
            self._doubtful = order.motion is None
            self._last_sent = order
            if self._order is order:
                self._order = None
            self._wake.notify_all()

    def _halt(self, halts: int) -> None:
        """Clear the go-to bit, which stops the fingers. Only a reset can end an activation or a release."""
        sample = self._newest
        assert sample is not None
        before = sample.status
        cannot_hold = before.activation is Activation.ACTIVATING or before.fault == RELEASING
        self._write(ACTIVATE if before.activated and not cannot_hold else 0, None)
        with self._wake:
            self._sent = self._unechoed_ns = None
            self._life.overtaken(None, self._clock.now())
            self._halts_done = max(self._halts_done, halts)
            self._wake.notify_all()

    def _write(self, action: int, motion: Motion | None) -> None:
        self._begin()
        self._transport.write(action, motion)
        self._good()

    def _poll(self) -> None:
        began = self._polled_ns = self._begin()
        status = self._transport.read()
        now = self._looked_ns = self._clock.now()
        with self._wake:
            last = self._newest
            status = self._life.shown(status, now)
            self._fastest_ns = min(self._fastest_ns, now - began)
            began = min(began, now - nanoseconds(self._transport.waited_s))
            # A slow answer left the gripper as early as a fast one, and was under way for longer (Cristian 1989). If
            # the request was slow instead, the status is younger than its stamp, which does no harm.
            self._newest = Sample(began + self._fastest_ns // 2, 0 if last is None else last.seq + 1, status)
            if last is not None and last.status.echo != status.echo:
                self._unechoed_ns = None
            self._await_echo(self._newest)
            self._good()
            self._wake.notify_all()

    def _await_echo(self, sample: Sample | None) -> None:
        """Record since when the echo lags behind the last motion."""
        if not self._certain or self._sent is None or sample is None or sample.status.echo == self._sent[1].position:
            self._unechoed_ns = None
        elif self._unechoed_ns is None:
            self._unechoed_ns = self._sent[0]

    def _begin(self) -> int:
        self._last_ns = self._clock.now()
        self.counts.requests += 1
        return self._last_ns

    def _good(self) -> None:
        self._good_ns = self._clock.now()
        self._error = None
        self._doubtful = False

    def _trusted(self) -> bool:
        now = self._clock.now()
        newest = self._newest
        return newest is not None and now - self._looked_ns <= TRUSTED_NS and now - newest.t_ns <= OLDEST_TRUSTED_NS

    def _failed(self, error: DeviceError) -> None:
        if isinstance(error, DeviceTimeout):
            self.counts.timeouts += 1
        elif isinstance(error, ProtocolFault):
            self.counts.damaged += 1
        with self._wake:
            self._error = error
            self._doubtful = True
            self._life.interrupted(self._clock.now())
            self._wake.notify_all()
        # A socket whose peer has vanished, or an adapter that was unplugged and replugged, stays silent without an
        # error.
        if self._transport.is_open and self._clock.now() - self._good_ns > self._silence_ns:
            self._transport.close()

    def _pause(self, pause_ns: int) -> None:
        with self._wake:
            self._wake.wait_for(lambda: self._ending, seconds(pause_ns))
