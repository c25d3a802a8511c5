; gcode_flavor = reprapfirmware
M117 "Place the plate"
M118 S"begin"
G28
M83
G1 X5 Y5 Z1 F6000
G1 X-5 E1 F1200
M400
M84
