texel batch list.txt -o out
