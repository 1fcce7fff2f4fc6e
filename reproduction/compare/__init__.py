"""Two result trees side by side: did a change matter?"""
