G21         ; Set units to mm
G90         ; Absolute positioning
G1 Z2.54 F2540      ; Move to clearance level

; Operation 0
; Type: Outside
G1 X-10.000 Y-10.000 F2540
; plunge
G1 Z-1.0000 F127
; cut
G1 X10.000 Y-10.000 F1016
G1 X10.000 Y10.000
; Retract
G1 Z2.5400 F2540
M2
