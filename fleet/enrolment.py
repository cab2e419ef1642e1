# SPDX-License-Identifier: GPL-3.0-or-later
"""The members of a fleet, and the router's access control made from them: `fleet enroll`, `fleet expel`.

A folder holds `members.json` (names, roles, system ids), `passwords.txt` (the router's) or the certificates that
examples/zenoh-tls/make_certificates.py makes, `router.json5`, and one `NAME.json5` for each member. These name other
files without a folder: payloads/endpoints.py finds them in that folder, zenohd in the working directory.

A certificate cannot be revoked: zenoh does not read revocation lists (1.10). The router admits every certificate of the
fleet, but gives rights only to the names in its configuration, and an expelled name is never used again.
"""

import json
import secrets
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from enum import Enum
from pathlib import Path
from typing import Any

from payloads.mission_data import Json
from payloads.names import check_name
from storage.os_error import reason
from storage.small_files import read_bounded, replace_file

#: zenoh's own is 1,000. Each session costs the router some 100 kB.
_MAX_SESSIONS = 12_000
#: The router's configuration has a kB for each vehicle.
_MAX_BYTES = 64 << 20
_ACCEPT_PENDING = 1_000
#: Beyond this, samples to a slow receiver are dropped rather than collected.
_BUFFER_BYTES = 32 << 10
_LISTEN = ("declare_subscriber", "query", "liveliness_query", "declare_liveliness_subscriber")
_SPEAK = ("put", "delete", "declare_queryable", "reply", "liveliness_token")
#: Wildcards do not match verbatim chunks: each needs a separate expression.
_EXPRESSIONS = ("**", "**/@adv/**", "@cmd/**", "@mavlink/**")
_VIEWED = ("*/v1/**", "*/v1/**/@adv/**")


#: System ids of vehicles. Ground stations have the others.
SYSIDS = range(1, 251)
#: NAME.json5, NAME.pem and NAME.key are the router's, or those of the certificate authority.
_RESERVED = ("router", "ca")
_ROUTER, _MEMBERS, _PASSWORDS, _CA = "router.json5", "members.json", "passwords.txt", "ca.pem"


class Role(Enum):
    """A member's rights: to be one vehicle, to do everything, only to watch, or none any more."""

    VEHICLE = "vehicle"
    PILOT = "pilot"
    GUEST = "guest"
    EXPELLED = "expelled"


class EnrolmentError(Exception):
    """A member cannot be enrolled or expelled, in one sentence."""


@dataclass(frozen=True, slots=True)
class Member:
    """`sysid`: a vehicle's MAVLink system id, unique in the fleet, else None."""

    role: Role
    sysid: int | None = None


@dataclass(frozen=True, slots=True)
class Enrolled:
    """A new member, and the files for it alone."""

    member: Member
    files: Sequence[Path]


@dataclass(frozen=True, slots=True)
class FleetRouter:
    """The router. `endpoint`: the address for members. `prefix`: the first part of the vehicles' keys."""

    endpoint: str
    prefix: str

    @property
    def is_tls(self) -> bool:
        """True if members have certificates, else each has a password."""
        return self.endpoint.startswith(("tls/", "quic/"))


@dataclass(frozen=True, slots=True)
class FleetFolder:
    """A fleet's files. Methods raise EnrolmentError if they cannot be read or written."""

    path: Path

    def enroll(self, name: str, role: Role, router: FleetRouter) -> Enrolled:
        """Add a member and write the router's configuration. ZenohSettingsError."""
        _check_member(name)
        check_name("--prefix", router.prefix)
        members, _ = self._load()
        former = members.get(name, Member(role))
        if former.role is Role.EXPELLED and router.is_tls:
            raise EnrolmentError(f"{name} was expelled, and its certificate is still valid: choose another name")
        if former.role not in (role, Role.EXPELLED):
            raise EnrolmentError(f"{name} is a {former.role.value} already: choose another name")
        members = _with_sysids(members | {name: Member(role, former.sysid)})
        own = self._write(f"{name}.json5", self._session(name, router), 0o600)
        self._save(members, router)
        files = [own, *(self.path / file for file in (_CA, f"{name}.pem", f"{name}.key") if router.is_tls)]
        return Enrolled(members[name], files)

    def expel(self, name: str) -> None:
        """Remove a member's rights, password and login. May be repeated, for example after the disk was full."""
        members, router = self._load()
        if router is None or name not in members:
            present = sorted(each for each, member in members.items() if member.role is not Role.EXPELLED)
            raise EnrolmentError(f"{name} is not a member; the members are: {', '.join(present) or 'none'}")
        passwords = self._passwords()
        if passwords.pop(name, None) is not None:
            self._write_passwords(passwords)
        self._save(members | {name: Member(Role.EXPELLED)}, router)
        (self.path / f"{name}.json5").unlink(missing_ok=True)

    def _load(self) -> tuple[dict[str, Member], FleetRouter | None]:
        """The members by name, including those expelled, and the router; none of both in a new folder."""
        try:
            found = json.loads(self._read(_MEMBERS) or '{"members": {}, "router": null}')
            router = found["router"]
            members = _with_sysids({name: _member(data) for name, data in found["members"].items()})
            return members, router and FleetRouter(str(router["endpoint"]), str(router["prefix"]))
        except (ValueError, AttributeError, LookupError, TypeError) as error:
            raise EnrolmentError(f"{self.path / _MEMBERS} is not a list of members: {error}") from error

    def _save(self, members: Mapping[str, Member], router: FleetRouter) -> None:
        """Write the list of members and the router's configuration."""
        listed = {
            name: {"role": each.role.value} | ({} if each.sysid is None else {"sysid": each.sysid})
            for name, each in members.items()
        }
        self._write(_MEMBERS, {"router": asdict(router), "members": listed}, 0o644)
        self._write(_ROUTER, self._router_config(members, router), 0o644)

    def _router_config(self, members: Mapping[str, Member], router: FleetRouter) -> Json:
        """Rules for each vehicle, no rules for unknown sessions."""
        scheme = router.endpoint.partition("/")[0]
        port = router.endpoint.rpartition(":")[2]
        files = {"listen_certificate": "router.pem", "listen_private_key": "router.key"}
        tls = self._tls(files) if router.is_tls else {}
        return {
            "mode": "router",
            "listen": {"endpoints": [f"{scheme}/0.0.0.0:{port}"]},
            "scouting": {"multicast": {"enabled": False}},
            "timestamping": {"enabled": True},
            "transport": {
                "unicast": {"max_sessions": _MAX_SESSIONS, "accept_pending": _ACCEPT_PENDING},
                "link": {"tcp": {"so_sndbuf": _BUFFER_BYTES, "so_rcvbuf": _BUFFER_BYTES}, **tls},
                "auth": {} if router.is_tls else {"usrpwd": {"dictionary_file": _PASSWORDS}},
            },
            "access_control": access_control(
                router.prefix, {name: each.role for name, each in members.items()}, by_certificate=router.is_tls
            ),
        }

    @staticmethod
    def _tls(files: Mapping[str, str]) -> Json:
        more = {"enable_mtls": True, "close_link_on_expiration": True}
        return {"protocols": ["tls"], "tls": {"root_ca_certificate": _CA, **files, **more}}

    def _session(self, name: str, router: FleetRouter) -> Json:
        session: Json = {
            "mode": "client",
            "connect": {"endpoints": [router.endpoint]},
            "scouting": {"multicast": {"enabled": False}},
        }
        if router.is_tls:
            files = {"connect_certificate": f"{name}.pem", "connect_private_key": f"{name}.key"}
            return session | {"transport": {"link": self._tls(files)}}
        return session | {"transport": {"auth": {"usrpwd": {"user": name, "password": self._password(name)}}}}

    def _password(self, name: str) -> str:
        """The member's password. A new member gets a new password."""
        known = self._passwords()
        if name not in known:
            known[name] = secrets.token_urlsafe(18)
            self._write_passwords(known)
        return known[name]

    def _passwords(self) -> dict[str, str]:
        return dict(line.split(":", 1) for line in self._read(_PASSWORDS).splitlines() if ":" in line)

    def _write_passwords(self, passwords: Mapping[str, str]) -> None:
        self._write_text(_PASSWORDS, "".join(f"{name}:{password}\n" for name, password in passwords.items()), 0o600)

    def _write(self, name: str, content: Json, mode: int) -> Path:
        return self._write_text(name, json.dumps(content, indent=2) + "\n", mode)

    def _write_text(self, name: str, text: str, mode: int) -> Path:
        path = self.path / name
        try:
            self.path.mkdir(parents=True, exist_ok=True)
            replace_file(path, text.encode(), mode)
        except OSError as error:
            raise EnrolmentError(f"{path} cannot be written: {reason(error)}") from error
        return path

    def _read(self, name: str) -> str:
        """A file's text, or empty if there is none yet."""
        path = self.path / name
        try:
            return read_bounded(path, _MAX_BYTES).decode()
        except FileNotFoundError:
            return ""
        except (OSError, UnicodeDecodeError) as error:
            raise EnrolmentError(f"{path} cannot be read: {reason(error)}") from error


def _member(data: Any) -> Member:
    """ValueError, AttributeError, LookupError."""
    sysid = data.get("sysid")
    if sysid is not None and sysid not in SYSIDS:
        raise ValueError(f"{sysid!r} is not a system id")
    return Member(Role(data["role"]), sysid)


def _with_sysids(members: Mapping[str, Member]) -> dict[str, Member]:
    """Assign the lowest free system ids. Beyond the last there are none. ValueError if two members have the same."""
    taken: dict[int, str] = {}
    for name, each in members.items():
        if each.sysid is not None and (other := taken.setdefault(each.sysid, name)) != name:
            raise ValueError(f"{other} and {name} both have system id {each.sysid}")
    free = (sysid for sysid in SYSIDS if sysid not in taken)
    return {
        name: replace(each, sysid=next(free, None)) if each.role is Role.VEHICLE and each.sysid is None else each
        for name, each in members.items()
    }


def _check_member(name: str) -> None:
    """ZenohSettingsError, or EnrolmentError for a name that is fit for a vehicle, but not for the files and login."""
    check_name("the name", name)
    if name.lower() in _RESERVED:
        raise EnrolmentError(f"{name!r} is the name of the fleet's own files: choose another name")
    if ":" in name or name.startswith((".", "-")):
        raise EnrolmentError(f"the name is {name!r}, but must not contain a colon or begin with a dot or dash")


def access_control(prefix: str, members: Mapping[str, Role], *, by_certificate: bool) -> Json:
    """Zenoh's access control. Everything not listed is denied."""
    everything = [
        f"{prefix}/{each}" if each[0] == "*" and each[1] == "*" else f"{prefix}/*/{each}" for each in _EXPRESSIONS
    ]
    viewed = [f"{prefix}/{each}" for each in _VIEWED]
    rules = [
        _rule("everything", ["ingress", "egress"], [*_LISTEN, *_SPEAK], everything),
        # A guest sends only queries. The router passes on only replies to it.
        _rule("ask", ["ingress"], _LISTEN, viewed),
        _rule("be answered", ["egress"], [*_LISTEN, *_SPEAK], viewed),
        _rule("be asked", ["egress"], ["put", "delete", *_LISTEN], everything),
    ]
    by_role = {Role.PILOT: ["everything"], Role.GUEST: ["ask", "be answered"]}
    policies = []
    members = {name: role for name, role in members.items() if role is not Role.EXPELLED}
    for name, role in members.items():
        if role is Role.VEHICLE:
            own = [f"{prefix}/{name}/{each}" for each in _EXPRESSIONS]
            rules.append(
                _rule(_own_rule(name), ["ingress"], [each for each in (*_LISTEN, *_SPEAK) if each != "query"], own)
            )
        allowed = by_role.get(role, ["be asked", _own_rule(name)])
        policies.append({"subjects": [name], "rules": allowed})
    key = "cert_common_names" if by_certificate else "usernames"
    return {
        "enabled": True,
        "default_permission": "deny",
        "rules": rules,
        "subjects": [{"id": name, key: [name]} for name in members],
        "policies": policies,
    }


def _own_rule(vehicle: str) -> str:
    return f"vehicle {vehicle}"


def _rule(name: str, flows: list[str], messages: list[str] | tuple[str, ...], expressions: list[str]) -> Json:
    return {
        "id": name,
        "permission": "allow",
        "flows": flows,
        "messages": list(messages),
        "key_exprs": expressions,
    }
