# SPDX-License-Identifier: GPL-3.0-or-later
"""The serial ports that `fc = "auto"` searches for a flight controller."""

from dataclasses import dataclass

from protocols.plain_text import plain_text
from service.machine.host import Host
from service.machine.raspberry_pi import pi_model

#: USB chips of flight controllers, idVendor and idProduct. systemd/60-naze-bridge.rules has the same list (a test
#: compares them). Other USB ports are opened only if they are named: opening one resets some 3D printers.
USB_CHIPS = {
    ("10c4", "ea60"): "CP210x",
    ("0403", "6001"): "FT232R",
    ("1a86", "7523"): "CH340",
    ("1a86", "5523"): "CH341",
    ("1a86", "55d4"): "CH9102",
    ("0483", "5740"): "STM32 USB",
    ("2e3c", "5740"): "AT32 USB",
    ("1209", "5740"): "ArduPilot USB",
    ("1209", "5741"): "ArduPilot USB",
}
#: Parts of product and manufacturer names that only radios and GPS receivers have. The udev rules also use them.
OTHER_PRODUCTS = ("gps", "gnss", "u-blox", "radio", "telemetry", "sik")


@dataclass(frozen=True, slots=True)
class SerialPort:
    """`path`: the device. `key`: the identity, made of the USB socket and the chip."""

    path: str
    key: str
    description: str


def serial_ports(host: Host) -> list[SerialPort]:
    """The candidates present, in the order they are tried: header first, then USB."""
    found = []
    model = pi_model(host)
    header = model.header_uart if model else "/dev/serial0"
    device = str(host.resolve(header))
    if host.path(device).exists():
        found.append(SerialPort(device, f"header {device}", "UART on the header"))
    for pattern in ("ttyUSB*", "ttyACM*"):
        found += [port for name in host.names("/dev", pattern) if (port := _usb_port(host, name)) is not None]
    return found


def _usb_port(host: Host, name: str) -> SerialPort | None:
    device = host.path(f"/sys/class/tty/{name}/device").resolve()
    # From the interface up to the USB device: two or three folders.
    for folder in (device, *device.parents[:3]):
        if (folder / "idVendor").exists():
            break
    else:
        return None
    facts = {fact: _read(folder / fact) for fact in ("idVendor", "idProduct", "manufacturer", "product", "serial")}
    chip = USB_CHIPS.get((facts["idVendor"], facts["idProduct"]))
    product = f"{facts['manufacturer']} {facts['product']}".strip()
    if chip is None or any(word in product.lower() for word in OTHER_PRODUCTS):
        return None
    key = f"usb {folder.name} {facts['idVendor']}:{facts['idProduct']} {facts['serial']}".strip()
    return SerialPort(f"/dev/{name}", key, product or chip)


def _read(path: object) -> str:
    try:
        with open(str(path), errors="replace") as file:
            return plain_text(file.read().strip())
    except OSError:
        return ""
