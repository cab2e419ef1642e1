# SPDX-License-Identifier: GPL-3.0-or-later
"""A Naze32 emulated at register level: it runs a real firmware image, instruction by instruction.

Unicorn (the optional extra `emulator`) executes the Cortex-M3 code. Everything around the core is here, one file for
each peripheral. Section numbers are those of ST's reference manual RM0008 unless another document is named.
"""
