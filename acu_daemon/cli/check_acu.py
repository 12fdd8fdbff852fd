"""What `acu-daemon check` asks of the ACU: identity, status and faults, nothing that moves it."""

import asyncio
from collections.abc import Iterator

from acu_daemon.acu.commands import AcuMode, Identify, ReadFaults
from acu_daemon.acu.replies import AcuIdentity, AcuStatus, FaultReport, Reply, beyond_own_limits
from acu_daemon.cli.check_finding import GO, NO_GO, WARN, Finding
from acu_daemon.config.station_tables import StationFile
from acu_daemon.config.to_settings import driver_of
from acu_daemon.daemon.port import AcuPort
from acu_daemon.edge.clock import SystemClock, system_tai_s
from acu_daemon.edge.link import make_link
from acu_daemon.errors import LinkError
from acu_daemon.pointing.way_round import why_not_stow
from acu_daemon.pointing.wrap import middle_deg, nearest_turn

ACU_S = 3.0  # for all that is asked of it: a reply or two may be lost


async def acu_findings(station: StationFile) -> list[Finding]:
    """Ask identity, status and faults: nothing that moves or changes the ACU."""
    acu = station.acu
    link, clock = make_link(acu.url), SystemClock()
    driver = driver_of(station)
    port = AcuPort(link, clock, driver, acu.period_s, acu.device_delay_s)
    try:
        await port.open(tries_all=True)
        async with asyncio.timeout(ACU_S):
            first = port.take_first()
            status = first.reply if first and isinstance(first.reply, AcuStatus) else await port.status()
            identity, faults = await port.reply_to(Identify()), await port.reply_to(ReadFaults())
    except LinkError as error:
        return [Finding(NO_GO, "ACU", str(error))]
    except TimeoutError:
        why = port.problem or f"{port.failed_exchange_count} replies were missing or late"
        return [Finding(NO_GO, "ACU", f"{link.description}: {why}: look at the line")]
    finally:
        await link.close()
        clock.close()
    findings = list(_told(status, identity, faults, has_receiver=driver.capabilities.has_autotrack))
    findings += _limits(identity, station)
    bounds = station.bounds
    az_deg = nearest_turn(status.az_deg, middle_deg(bounds.azimuth), bounds.azimuth)
    if bounds.stow_deg is not None and az_deg is not None:
        why = why_not_stow(bounds, (az_deg, status.el_deg), system_tai_s())
        findings.append(Finding(WARN if why else GO, "way to stow", why or "clear from where the antenna stands"))
    if port.failed_exchange_count:
        late = f" {port.late_count} came too late, {port.lateness}:" if port.late_count else ""
        lost = f"{port.failed_exchange_count} had no answer in time;{late} look at the line, `latency-test` measures it"
        findings.append(Finding(WARN, "ACU replies", lost))
    return findings


def _limits(identity: Reply, station: StationFile) -> Iterator[Finding]:
    """Of an ACU that says what its limits are."""
    if isinstance(identity, AcuIdentity) and identity.azimuth is not None:
        beyond = beyond_own_limits(identity, station.acu.azimuth.limits(), station.acu.elevation.limits())
        yield Finding(NO_GO if beyond else GO, "ACU limits", beyond or "hold those of station.toml")


def _told(status: AcuStatus, identity: Reply, faults: Reply, *, has_receiver: bool) -> Iterator[Finding]:
    who = str(identity) if isinstance(identity, AcuIdentity) else "does not identify itself"
    agc = f", AGC {status.agc_db:.1f} dB" if has_receiver else "; no signal: program track"
    yield Finding(GO, "ACU", f"{who}, {status.mode.name}, az {status.az_deg:.2f} el {status.el_deg:.2f}{agc}")
    if status.mode is AcuMode.MANUAL or not status.is_remote_enabled:
        yield Finding(NO_GO, "ACU control", "the local panel has control: switch the ACU to REMOTE")
    else:
        yield Finding(GO, "ACU control", "remote control is enabled")
    named = ", ".join(faults.texts) if isinstance(faults, FaultReport) else ""
    if status.mode is AcuMode.FAULT or named:
        yield Finding(NO_GO, "ACU faults", named or "mode FAULT")
    else:
        yield Finding(GO, "ACU faults", "none")
    if not status.is_receiver_valid:
        yield Finding(WARN, "receiver", "the ACU calls its receiver not valid: no AGC, or no demodulator")
    if status.mode in (AcuMode.STOWED, AcuMode.STOWING):
        yield Finding(WARN, "stow", f"{status.mode.name}: the daemon leaves it when the pass is near")
