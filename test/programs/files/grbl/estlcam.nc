(Project test)
(Created by Estlcam version 11 build 11.244 Grbl)
(Machining time about 00:00:23 minutes)

(Required tools:)
(Endmill 3mm)
G90
M03 S24000
G00 Z5.0000

(No. 1: Part 1)
G00 X-10.0000 Y-10.0000
G00 Z0.5000
G01 Z-1.0000 F720 S24000
G01 X10.0000 F1440
G01 Y10.0000
G00 Z5.0000
G00 Y0.0000 X0.0000
M05
M30
