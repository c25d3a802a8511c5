; config-override.g file generated in response to M500 at 2021-03-14 15:09
; This is a system-generated file - do not edit
; Delta parameters
M665 L215.000:215.107:214.950 R105.603 H250.104 B85.0 X0.213 Y-0.402 Z0.000
M666 X0.121 Y-0.062 Z-0.059 A0.00 B0.00
; Heater model parameters
M307 H0 R0.500 K0.30:0.00 D5.50 E1.35 S1.00 B0
; Workspace coordinates
G10 L2 P1 X0.00 Y0.00 Z0.00
