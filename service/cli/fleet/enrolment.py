# SPDX-License-Identifier: GPL-3.0-or-later
"""The members of a fleet, and the router's access control made from them: `fleet enroll`. Files are JSON5.

A folder holds `members.json` (names and roles), `passwords.txt` (the router's) or the certificates that
examples/zenoh-tls/make_certificates.py makes, `router.json5`, and one `NAME.json5` for each member.
"""

import json
import secrets
from collections.abc import Mapping
from dataclasses import dataclass
from enum import Enum
from pathlib import Path

from service.daemon.mission_data import Json
from service.settings.zenoh import check_name
from storage.os_error import reason

#: zenoh's own is 1,000. Each session costs the router some 100 kB.
_MAX_SESSIONS = 12_000
_ACCEPT_PENDING = 1_000
#: Beyond this, samples to a slow receiver are dropped rather than collected.
_BUFFER_BYTES = 32 << 10
_LISTEN = ("declare_subscriber", "query", "liveliness_query", "declare_liveliness_subscriber")
_SPEAK = ("put", "delete", "declare_queryable", "reply", "liveliness_token")
#: Verbatim chunks match no wildcard: each needs its own expression.
_EXPRESSIONS = ("**", "**/@adv/**", "@cmd/**", "@mavlink/**")
_VIEWED = ("*/v1/**", "*/v1/**/@adv/**")


class Role(Enum):
    """A member's rights: to be one vehicle, to do everything, or only to watch."""

    VEHICLE = "vehicle"
    PILOT = "pilot"
    GUEST = "guest"


class EnrolmentError(Exception):
    """A member cannot be enrolled; one sentence."""


@dataclass(frozen=True, slots=True)
class FleetFolder:
    """A fleet's files. `tls`: members have certificates; else each has a password."""

    path: Path
    prefix: str
    router: str

    @property
    def is_tls(self) -> bool:
        return self.router.startswith(("tls/", "quic/"))

    def members(self) -> dict[str, Role]:
        """Names and roles; EnrolmentError if they cannot be read."""
        path = self.path / "members.json"
        try:
            return {name: Role(role) for name, role in json.loads(path.read_text()).items()}
        except FileNotFoundError:
            return {}
        except OSError as error:
            raise EnrolmentError(f"{path} cannot be read: {reason(error)}") from error
        except (ValueError, AttributeError) as error:
            raise EnrolmentError(f"{path} is not a list of members: {error}") from error

    def enroll(self, name: str, role: Role) -> list[Path]:
        """Add a member and write the router's configuration; returns the member's own files. ZenohSettingsError."""
        check_name("the name", name)
        check_name("--prefix", self.prefix)
        members = self.members()
        if members.get(name, role) is not role:
            raise EnrolmentError(f"{name} is a {members[name].value} already: choose another name")
        members[name] = role
        try:
            self.path.mkdir(parents=True, exist_ok=True)
            own = self._write(f"{name}.json5", self._session(name), is_secret=True)
            self._write("router.json5", self.router_config(members))
            self._write("members.json", {each: its.value for each, its in members.items()})
        except OSError as error:
            raise EnrolmentError(f"{self.path} cannot be written: {reason(error)}") from error
        return [own] if not self.is_tls else [own, *(self.path / f"{name}.{kind}" for kind in ("pem", "key"))]

    def router_config(self, members: Mapping[str, Role]) -> Json:
        """The router's configuration: rules for each vehicle, nothing for unknown sessions."""
        scheme = self.router.partition("/")[0]
        port = self.router.rpartition(":")[2]
        tls = self._tls({"listen_certificate": "router.pem", "listen_private_key": "router.key"}) if self.is_tls else {}
        return {
            "mode": "router",
            "listen": {"endpoints": [f"{scheme}/0.0.0.0:{port}"]},
            "scouting": {"multicast": {"enabled": False}},
            "timestamping": {"enabled": True},
            "transport": {
                "unicast": {"max_sessions": _MAX_SESSIONS, "accept_pending": _ACCEPT_PENDING},
                "link": {"tcp": {"so_sndbuf": _BUFFER_BYTES, "so_rcvbuf": _BUFFER_BYTES}, **tls},
                "auth": {} if self.is_tls else {"usrpwd": {"dictionary_file": str(self.path / "passwords.txt")}},
            },
            "access_control": access_control(self.prefix, members, by_certificate=self.is_tls),
        }

    def _tls(self, files: Mapping[str, str]) -> Json:
        files = {"root_ca_certificate": "ca.pem", **files}
        paths = {setting: str(self.path / file) for setting, file in files.items()}
        return {"protocols": ["tls"], "tls": {**paths, "enable_mtls": True, "close_link_on_expiration": True}}

    def _session(self, name: str) -> Json:
        session: Json = {
            "mode": "client",
            "connect": {"endpoints": [self.router]},
            "scouting": {"multicast": {"enabled": False}},
        }
        if self.is_tls:
            files = {"connect_certificate": f"{name}.pem", "connect_private_key": f"{name}.key"}
            return session | {"transport": {"link": self._tls(files)}}
        return session | {"transport": {"auth": {"usrpwd": {"user": name, "password": self._password(name)}}}}

    def _password(self, name: str) -> str:
        """The member's password; a new member gets a new one."""
        path = self.path / "passwords.txt"
        lines = path.read_text().splitlines() if path.exists() else []
        known = dict(line.split(":", 1) for line in lines if ":" in line)
        if name not in known:
            known[name] = secrets.token_urlsafe(18)
            _write_secret(path, "".join(f"{each}:{password}\n" for each, password in known.items()))
        return known[name]

    def _write(self, name: str, content: Json, *, is_secret: bool = False) -> Path:
        path = self.path / name
        text = json.dumps(content, indent=2) + "\n"
        if is_secret:
            _write_secret(path, text)
        else:
            path.write_text(text)
        return path


def access_control(prefix: str, members: Mapping[str, Role], *, by_certificate: bool) -> Json:
    """Zenoh's access control; everything not listed is denied."""
    everything = [
        f"{prefix}/{each}" if each[0] == "*" and each[1] == "*" else f"{prefix}/*/{each}" for each in _EXPRESSIONS
    ]
    viewed = [f"{prefix}/{each}" for each in _VIEWED]
    rules = [
        _rule("everything", ["ingress", "egress"], [*_LISTEN, *_SPEAK], everything),
        # A guest sends only queries; the router passes on only replies to it.
        _rule("ask", ["ingress"], _LISTEN, viewed),
        _rule("be answered", ["egress"], [*_LISTEN, *_SPEAK], viewed),
        _rule("be asked", ["egress"], ["put", "delete", *_LISTEN], everything),
    ]
    by_role = {Role.PILOT: ["everything"], Role.GUEST: ["ask", "be answered"]}
    policies = []
    for name, role in members.items():
        if role is Role.VEHICLE:
            own = [f"{prefix}/{name}/{each}" for each in _EXPRESSIONS]
            rules.append(
                _rule(f"be {name}", ["ingress"], [each for each in (*_LISTEN, *_SPEAK) if each != "query"], own)
            )
        allowed = by_role.get(role, ["be asked", f"be {name}"])
        policies.append({"subjects": [name], "rules": allowed})
    key = "cert_common_names" if by_certificate else "usernames"
    return {
        "enabled": True,
        "default_permission": "deny",
        "rules": rules,
        "subjects": [{"id": name, key: [name]} for name in members],
        "policies": policies,
    }


def _rule(name: str, flows: list[str], messages: list[str] | tuple[str, ...], expressions: list[str]) -> Json:
    return {
        "id": name,
        "permission": "allow",
        "flows": flows,
        "messages": list(messages),
        "key_exprs": expressions,
    }


def _write_secret(path: Path, text: str) -> None:
    path.touch(mode=0o600)
    path.chmod(0o600)
    path.write_text(text)
