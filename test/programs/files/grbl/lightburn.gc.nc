; LightBurn 1.4.03
; GRBL device profile, absolute coords
; Bounds: X-10 Y-10 to X10 Y10
G00 G17 G40 G21 G54
G90
M4
; Cut @ 600 mm/min, 50% power
M8
G0 X-10Y-10
; Layer C00
G1 X10Y-10S500F600
G1 X10Y10
G1 X-10Y10
G1 X-10Y-10
M9
G1 S0
M5
G90
; return to user-defined finish pos
G0 X0 Y0
M2
