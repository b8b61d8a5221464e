/* Compiled into User-Mode Linux by with-vcan. What vector registers each process of the host was left with, so that they
 * aren't set again on its way back from every system call: setting them maps and unmaps a page in the host, which is most
 * of a system call where the host is a guest itself. Code that runs in such a process without being the guest's own (the
 * stub) changes them: it forgets. */
#include <string.h>

#define PROCESSES 16 /* more take turns, and set more often than they need */

static struct {
	int pid;
	size_t bytes; /* 0: not known */
	char registers[FP_SIZE * sizeof(unsigned long)];
} left_with[PROCESSES];
static unsigned int replaced_next;

static unsigned int place_of(int pid)
{
	unsigned int i;

	for (i = 0; i < PROCESSES; i++)
		if (left_with[i].pid == pid)
			return i;
	i = replaced_next++ % PROCESSES;
	left_with[i].pid = pid;
	left_with[i].bytes = 0;
	return i;
}

void forget_fp_registers(int pid)
{
	left_with[place_of(pid)].bytes = 0;
}

static int has_fp_registers(int pid, const void *registers)
{
	unsigned int i = place_of(pid);

	return left_with[i].bytes && !memcmp(left_with[i].registers, registers, left_with[i].bytes);
}

static int remember_fp_registers(int pid, const void *registers, size_t bytes)
{
	unsigned int i = place_of(pid);

	left_with[i].bytes = bytes;
	memcpy(left_with[i].registers, registers, bytes);
	return 0;
}
