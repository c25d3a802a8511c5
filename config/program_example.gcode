(ros2 run tri_glide_kinematics drive program_example.gcode, with program_settings.yaml)
G21 G90 G17 G54 G64 P1 F6000 (mm; corners may be cut by 1 mm; 100 mm/s)
M3 S1000                     (an output, before anything moves)
G0 X0 Y0 Z20
G1 Z0
X40                          (a square with rounded corners)
Y40
X0
G3 X0 Y0 J-20                (half a circle back)
G4 P0.5
M5
G0 Z20
M2
