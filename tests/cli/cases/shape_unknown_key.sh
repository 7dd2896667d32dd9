echo "{\"format\": \"texel-shape\", \"shape\": {\"sphere\": {\"radius\": 1, \"colour\": 2}}}" > s.json
texel bake s.json -o x.texel
