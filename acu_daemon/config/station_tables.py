"""station.toml: its tables and their keys, defaults, what each value may be."""

from typing import Literal

from pydantic import Field, model_validator

from acu_daemon.config.acu_tables import AcuSection
from acu_daemon.config.antenna_tables import AtmosphereSection, MountSection, antenna_of
from acu_daemon.config.elements_tables import ElementsSourcesSection
from acu_daemon.config.envelope_tables import EnvelopeSection
from acu_daemon.config.outlet_tables import MetricsSection, MqttSection, RotctldSection
from acu_daemon.config.recording_tables import RecordingSection
from acu_daemon.config.schedule_tables import ScheduleSection
from acu_daemon.config.section import Name, Section
from acu_daemon.config.station_day_tables import HooksSection, WindSection
from acu_daemon.config.tracking_tables import ReadingsSection, ReceiverSection, TrackingSection
from acu_daemon.config.web_tables import WebSection
from acu_daemon.model import EarthOrientation, Site, Station
from acu_daemon.pointing.envelope import Envelope
from acu_daemon.pointing.mount import Mount


class StationSection(Section):
    latitude_deg: float = Field(
        ge=-90,
        le=90,
        description=(
            "Geodetic latitude of the antenna (WGS84), north positive.  Decides where the satellite is seen: 0.01 deg "
            "are 1.1 km."
        ),
    )
    longitude_deg: float = Field(
        ge=-180, le=360, description="Longitude of the antenna, east positive.  Decides the same."
    )
    height_m: float = Field(
        ge=-500,
        le=9000,
        description=(
            "Height over the ellipsoid (WGS84), not over the sea.  Decides the direction of near satellites, and the "
            "standard air."
        ),
    )
    name: Name = Field(
        default="station",
        description=(
            "The station's name, for people.  Decides the folder of the antenna's state, with the ACU's address."
        ),
    )
    min_elevation_deg: float = Field(
        default=5.0,
        ge=0,
        lt=90,
        description="The horizon of the station.  Decides when a pass begins and ends, and how low a search may look.",
    )
    uncertainty_m: float = Field(
        default=0.0,
        ge=0,
        description=(
            "How well the place is known over the ground, 1 sigma.  Decides whether `full` fits the place too (above "
            "0), and how far it may go."
        ),
    )


class TimeSection(Section):
    ut1_utc_s: float = Field(
        default=0.0,
        ge=-1,
        le=1,
        description=(
            "UT1 - UTC of the date, from IERS Bulletin A.  Decides how far the Earth has turned: 0.5 s is 0.01 to "
            "0.03 deg on a low orbit."
        ),
    )
    polar_motion_x_arcsec: float = Field(
        default=0.0,
        ge=-2,
        le=2,
        description="Polar motion x of the date, from the same.  Decides the station's place by up to 10 m.",
    )
    polar_motion_y_arcsec: float = Field(default=0.0, ge=-2, le=2, description="Polar motion y.  Decides the same.")
    earth_orientation: Name | None = Field(
        default=None,
        json_schema_extra={"range": "a path"},
        description=(
            "A file of the IERS (finals2000A or C04) beside station.toml.  Decides the three numbers above by the "
            "date of the pass; give the file or the numbers."
        ),
    )

    @model_validator(mode="after")
    def _numbers_or_a_file(self) -> "TimeSection":
        if self.earth_orientation is not None and (typed := sorted(self.model_fields_set - {"earth_orientation"})):
            raise ValueError(
                f"earth_orientation = {self.earth_orientation!r} and {', '.join(typed)}: expected the file or the "
                "numbers, not both; leave the numbers out"
            )
        return self

    @property
    def orientation(self) -> EarthOrientation:
        return EarthOrientation(self.ut1_utc_s, self.polar_motion_x_arcsec, self.polar_motion_y_arcsec)


class SafetySection(Section):
    arm: Literal["auto", "manual"] = Field(
        default="auto",
        description=(
            "`manual`: nothing is written until a person says `acu-daemon arm`.  Decides whether the daemon may move "
            "the antenna from its start on."
        ),
    )
    register_watchdog_s: float = Field(
        default=5.0,
        ge=0,
        le=600,
        json_schema_extra={"range": "0, or 2 to 600"},
        description=(
            "The ACU stops the antenna when its registers go unwritten for so long; 0: its watchdog is not touched.  "
            "Decides what happens when the daemon dies and does not come back."
        ),
    )
    following_error_deg: float = Field(
        default=1.0,
        ge=0.2,
        le=30,
        description=(
            "On the sky: what an axis may be off its command, beyond lag, noise and wind.  Decides when an axis that "
            "stands still, runs away or turns the wrong way is stopped and latched."
        ),
    )
    following_error_s: float = Field(
        default=2.0,
        ge=0,
        le=60,
        json_schema_extra={"range": "0, or 0.5 to 60"},
        description="For how long it may be; 0: the axes are not watched.  Decides the same.",
    )
    clock_alarm_beam_fraction: float = Field(
        default=0.1,
        gt=0,
        le=10,
        description=(
            "A clock whose error moves the satellite by this share of the beam, at the present rate, is an alarm.  "
            "Decides what is told about the clock, not what is commanded."
        ),
    )

    @model_validator(mode="after")
    def _none_or_enough(self) -> "SafetySection":
        for name, least_s in (("register_watchdog_s", 2.0), ("following_error_s", 0.5)):
            if 0.0 < getattr(self, name) < least_s:
                raise ValueError(f"{name} = {getattr(self, name):g}: expected 0 (off) or at least {least_s:g}")
        return self


class StationFile(Section):
    station: StationSection = Field(description="Where the antenna stands.")
    acu: AcuSection = Field(description="The antenna control unit and the line to it.")
    receiver: ReceiverSection = Field(default=ReceiverSection(), description="What the antenna receives with.")
    time: TimeSection = Field(
        default=TimeSection(), description="How the Earth is turned; the clock itself is the system's."
    )
    elements: ElementsSourcesSection = Field(
        default=ElementsSourcesSection(),
        description="Where elements come from besides the satellites' own files (docs/elements.md).",
    )
    readings: ReadingsSection = Field(default=ReadingsSection(), description="What the ACU's angles are worth.")
    tracking: TrackingSection = Field(
        default=TrackingSection(), description="How the orbit is fitted, predicted and searched."
    )
    safety: SafetySection = Field(
        default=SafetySection(), description="What must hold before and while the antenna moves."
    )
    envelope: EnvelopeSection = Field(
        default=EnvelopeSection(),
        description="What stands around the antenna, and what its beam keeps out of (docs/envelope.md).",
    )
    atmosphere: AtmosphereSection = Field(
        default=AtmosphereSection(), description="The air that the antenna looks through (docs/antenna-model.md)."
    )
    mount: MountSection = Field(
        default=MountSection(),
        description=(
            "What a survey of the mount gave: encoder = apparent direction + terms (docs/antenna-model.md has their "
            "signs)."
        ),
    )

    schedule: ScheduleSection = Field(
        default=ScheduleSection(), description="Which passes a station tracks by itself, and what it does between them."
    )

    hooks: HooksSection = Field(
        default=HooksSection(), description="Programs that are started at what happens in a pass (docs/schedule.md)."
    )
    mqtt: MqttSection = Field(default=MqttSection(), description="The MQTT broker that is told (docs/mqtt.md).")
    rotctld: RotctldSection = Field(
        default=RotctldSection(), description="The port for programs that speak to rotators (docs/rotctld.md)."
    )
    metrics: MetricsSection = Field(default=MetricsSection(), description="What Prometheus reads (docs/metrics.md).")
    wind: WindSection = Field(default=WindSection(), description="When the wind stows the antenna (docs/schedule.md).")

    recording: RecordingSection = Field(
        default=RecordingSection(), description="What is kept of every pass (docs/recordings.md)."
    )
    web: WebSection = Field(default=WebSection(), description="The operator's page (docs/page.md).")

    @model_validator(mode="after")
    def _is_some_air(self) -> "StationFile":
        s = self.station
        self.atmosphere.check(Station(s.name, s.latitude_deg, s.longitude_deg, s.height_m))
        return self

    @model_validator(mode="after")
    def _is_what_the_acu_can_do(self) -> "StationFile":
        acu = self.acu.driver().capabilities
        if self.receiver.signal == "acu" and not acu.has_autotrack:
            raise ValueError(
                f'receiver.signal = "acu": an ACU with dialect = "{self.acu.dialect}" has no autotrack and tells of no '
                'signal; leave it out, or say signal = "none" (program track) or "udp://ADDRESS:PORT"'
            )
        error_deg = self.safety.following_error_deg
        if self.safety.following_error_s and acu.dead_band_deg > error_deg / 2:
            raise ValueError(
                f"acu.dead_band_deg = {acu.dead_band_deg:g}: expected at most half of safety.following_error_deg = "
                f"{error_deg:g}, or an antenna that waits within it would be latched; raise following_error_deg"
            )
        return self

    @property
    def has_signal(self) -> bool:
        """Whether a pass is tracked by autotrack, which follows the signal; else it is flown by program track."""
        receiver = self.receiver
        if receiver.signal == "none" or receiver.program_track:
            return False
        return self.acu.driver().capabilities.has_autotrack

    @property
    def site(self) -> Site:
        s = self.station
        station = Station(s.name, s.latitude_deg, s.longitude_deg, s.height_m)
        antenna = antenna_of(self.atmosphere, self.mount, station)
        has_light_time = self.atmosphere.refraction  # a vacuum is that of truth files, which are geometric
        return Site(station, self.time.orientation, has_light_time, antenna, self.envelope.skyline)

    @property
    def bounds(self) -> Envelope:
        """All that bounds where the antenna is moved."""
        return Envelope(
            self.acu.azimuth.limits(),
            self.acu.elevation.limits(),
            tuple(one.zone() for one in self.envelope.keep_out),
            self.envelope.sun(self.site),
            self.envelope.skyline,
            None if (mount := self.mount.mount()) == Mount() else mount,
            self.envelope.stow_deg,
        )
