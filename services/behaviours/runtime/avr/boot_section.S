/* The boot loader, linked on its own to BOOT_LOADER, where a robot has it. */
.section .boot_loader, "ax", @progbits
.global kilo_boot_loader
kilo_boot_loader:
.incbin BOOT_LOADER
