; LightBurn 1.4.03
; Marlin device profile, absolute coords
; Bounds: X-10 Y-10 to X10 Y10
G00 G17 G40 G21 G54
G90
M84 S0
; Cut @ 600 mm/min, 50% power
M106 S0
G0 X-10 Y-10 F3000
M106 S127
G1 X10 Y-10 F600
G1 X10 Y10
G1 X-10 Y10
G1 X-10 Y-10
M107
G90
; return to user-defined finish pos
G0 X0 Y0 Z20
