/* The GRBL instrument with the EEPROM of real silicon. GRBL erases a byte to 0xFF without loading the data
 * register; simavr stores the register's old value instead, so that -20.999998 mm is read back as -20.875. */
#include "sim_avr.h"
#include "avr_eeprom.h"

enum { EEDR_ = 0x40, EEAR_LOW = 0x41, EEAR_HIGH = 0x42, PROGRAM = 0x02, ERASE_ONLY = 0x10, MODES = 0x30 };

static void eecr_write(avr_t *, avr_io_addr_t, uint8_t, void *);

static void eecr_erase(avr_t *avr, avr_io_addr_t address, uint8_t value, void *param) {
	if ((value & PROGRAM) && (value & MODES) == ERASE_ONLY) {
		uint8_t erased = 0xff;
		avr_eeprom_desc_t byte = { .ee = &erased, .offset = avr->data[EEAR_LOW] | avr->data[EEAR_HIGH] << 8, .size = 1 };
		avr->data[EEDR_] = erased;
		avr_ioctl(avr, AVR_IOCTL_EEPROM_SET, &byte);
	}
	eecr_write(avr, address, value, param);
}

#define avr_register_io_write(avr, address, write, param) \
	avr_register_io_write(avr, address, (void *)(write) == (void *)eecr_write ? eecr_erase : (write), param)
#include "grbl-pty.c"
