# SPDX-License-Identifier: GPL-3.0-or-later
"""The emulated board in a quadcopter: the motors carry it, the sensors feel it, and a GPS module is on USART2."""

import random
from dataclasses import dataclass
from math import asin, atan2, degrees, inf

from simulator.board.flight import Craft, FlightState
from simulator.board.simulated_board import Power
from simulator.emulated_naze import hmc5883l, mpu6050, ms5611
from simulator.emulated_naze.board import EmulatedNaze
from simulator.emulated_naze.chip import Chip, I2cDevice
from simulator.emulated_naze.image import Image
from simulator.emulated_naze.sky_sensors import SkyBarometer, SkyCompass, SkyImu
from simulator.emulated_naze.switches import EmulatedFaults
from simulator.sky.body import Airframe
from simulator.sky.earth import Place
from simulator.sky.gps_module import GpsModule
from simulator.sky.lies import Lies
from simulator.sky.sky import Sky, Weather
from simulator.sky.vectors import heading_of, to_body

#: With the GPS module's configuration.
FLYING_BOOT_S = 20.0
_GPS_USART = 2
#: How often the GPS module listens.
_SLICE_NS = 20_000_000
#: The converter's value for a volt of the battery, after a divider by 11.
_PER_VOLT = 4095 / 3.3 / 11


@dataclass(slots=True, kw_only=True)
class FlyingSwitches(EmulatedFaults):
    """The switches of a board in flight.

    `radio` 0 is a transmitter switched off, `gps_fix` 0 a hidden sky, `gps` 0 a broken wire to the module. `volts`
    other than 0 replaces the battery's.
    """

    radio: bool = True
    gps: bool = True
    gps_fix: bool = True
    volts: float = 0.0


class FlyingNaze(EmulatedNaze):
    """`heading`: of the nose at the launch place `place`, degrees."""

    faults: FlyingSwitches

    def __init__(
        self,
        image: Image,
        flash: memoryview | None = None,
        *,
        weather: Weather | None = None,
        frame: Airframe | None = None,
        heading: float = 0.0,
        place: Place | None = None,
        lies: Lies | None = None,
        longest_step_s: float = inf,
        tempo: float = 1.0,
    ) -> None:
        self._weather = weather or Weather()
        self.sky = Sky(self._weather, lambda: self._chip.motors_us(), frame, heading, place, lies)
        self.gps = GpsModule(self.sky.place, self._weather.seed, self.sky.lies)
        super().__init__(
            image, FlyingSwitches(), flash, seed=self._weather.seed, longest_step_s=longest_step_s, tempo=tempo
        )
        self._boot_s = FLYING_BOOT_S / tempo
        self._requested = self._is_pending = False

    def truth(self, now: float) -> Craft | None:
        """Its true state. Without the firmware's `boxes` and `home`."""
        self._run_until(now)
        if self.power is not Power.RUNNING:
            return None
        body, place = self.sky.body, self.sky.place
        lat, lon = place.coordinates(body.position)
        north, west, up = body.velocity
        forward_up, left_up, _ = to_body(body.attitude, (0.0, 0.0, 1.0))
        flight = FlightState(
            lat_e7=round(lat * 1e7),
            lon_e7=round(lon * 1e7),
            altitude_m=place.alt_m + body.position[2],
            height_m=body.position[2],
            climb_ms=up,
            speed_ms=body.speed,
            course=degrees(atan2(-west, north)) % 360,
            roll=-degrees(asin(left_up)),
            pitch=-degrees(asin(forward_up)),
            heading=heading_of(body.attitude),
            volts=self.faults.volts or self.sky.battery.volts,
        )
        return Craft(flight, self.armed, boxes=0, home=None)

    def _make_chip(self, program_size: int, seed: int) -> Chip:
        noise = random.Random(f"chips {seed}")
        devices: dict[int, I2cDevice] = {
            mpu6050.ADDRESS: SkyImu(noise, self.sky, self._move),
            hmc5883l.ADDRESS: SkyCompass(noise, self.sky, self._move),
            ms5611.ADDRESS: SkyBarometer(noise, self.sky, self._move),
        }
        return Chip(self.flash, program_size, self.faults, self.counters, seed, devices)

    def _run_chip_until(self, now: float) -> None:
        end_ns = self._chip_ns(now)
        while self._chip.now_ns < end_ns:
            gps_ns = int(self.gps.next_s * 1e9) + 1
            slice_ns = min(end_ns, max(gps_ns, self._chip.now_ns + 1_000_000), self._chip.now_ns + _SLICE_NS)
            super()._run_chip_until(self._seconds(slice_ns))
            self._move()
            self._exchange_with_gps()
            volts = self.faults.volts or self.sky.battery.volts
            self._chip.set_battery(min(int(volts * _PER_VOLT), 4095))

    def _move(self) -> None:
        self.sky.advance(self._chip.now_ns / 1e9)

    def _exchange_with_gps(self) -> None:
        chip, gps, body = self._chip, self.gps, self.sky.body
        now_s = chip.now_ns / 1e9
        baud = chip.baud(_GPS_USART)
        gps.has_fix, gps.is_silent = self.faults.gps_fix, not self.faults.gps
        gps.hear(chip.take_sent(_GPS_USART), baud)
        gps.advance(now_s, body.position, body.velocity)
        if sent := gps.take(now_s, baud):
            chip.receive(_GPS_USART, sent)

    def _move_sticks(self) -> None:
        """A request to arm moves the sticks once: a craft that has landed by itself must not be armed again."""
        request = self.faults.armed
        if request != self._requested:
            self._requested, self._is_pending = request, True
        self._is_pending = self._is_pending and request != self.armed
        self.faults.armed = request if self._is_pending else self.armed
        super()._move_sticks()
        self.faults.armed = request
        if not self.faults.radio:
            self._chip.set_receiver([0] * 8)
